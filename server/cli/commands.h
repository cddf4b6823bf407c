#pragma once
// What `cordillera` does, a command a function. Each returns the exit code: 0 done, 1 failed or bad input, 2 wrong usage.
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pipeline/build/build.h"
#include "pipeline/faces/face.h"
#include "pipeline/faces/look.h"
#include "pipeline/store/store.h"
#include "raster/pixels/value_look.h"
#include "server/cli/sources.h"
#include "server/datasets/data_folder.h"
#include "server/options/options.h"

namespace cordillera::server {

inline constexpr int kDone = 0, kFailed = 1, kUsage = 2;
/// Of work and of clients, what failed for a reason that may pass: storage, a stage below that is not finished, a service that is
/// away. sysexits.h calls it EX_TEMPFAIL.
inline constexpr int kTryAgain = 75;

/// cordillera serve. program: path of this binary; the viewer lies beside it. listening: told the port as soon as connections
/// wait there.
int serve_command(const Settings& settings, const std::string& program, const std::function<void(int port)>& listening = {});

/// What a command says besides problems.
enum class Verbosity { all, none };

enum class Show { table, json, problems };

/// What tiles of a folder or of an archive look like, as the command line has it. Empty: as Look has it.
struct LookWords {
  std::string normals;                 ///< "texture"
  std::string texture, size, quality;  ///< an orthophoto's file; pixels of it a tile's side, "512"; "85"
  std::string interval;                ///< of contours, "12.192"
};

/// Where a command writes what a dataset shows, and as what.
struct OutputLine {
  std::string output;  ///< a static folder; one .sqlite file, or one that export writes, if it is called so
  pipeline::Existing other = pipeline::Existing::refuse;  ///< what is in the output's place
  Verbosity words = Verbosity::all;
  std::vector<const pipeline::faces::Face*> formats;  ///< of the folder
  std::string only_format;  ///< of an archive, which holds one: its name; empty: the one that export takes
  LookWords look;           ///< of its tiles
};
struct BuildLine : OutputLine {
  std::vector<std::string> rasters;   ///< one, or several, folders and lists of them; see raster/mosaic/source_list.h
  BadSource bad = BadSource::refuse;  ///< among several rasters
  Show show = Show::table;            ///< of a dry run
};
/// "drc, 3d-tiles, …": every name that formats_of knows.
std::string face_names();
/// "drc,3d-tiles" as faces; empty: what a folder holds unless told otherwise.
proto::Result<std::vector<const pipeline::faces::Face*>> formats_of(const std::string& names);
/// Whether a folder of these formats shows what the words say.
proto::Result<void> check_look(const LookWords& look, const std::vector<const pipeline::faces::Face*>& formats);
/// An option of LookWords for a command line.
struct LookOption {
  const char *name, *type, *help;
  std::string LookWords::*value;
  const char* what;      ///< it says more of than a dataset holds: "3D Tiles"
  const char* faces;     ///< what their faces' names begin with
  const char* archives;  ///< that hold them, in words
};
std::span<const LookOption> look_options();
/// The first one that was given and is none of these faces; null: there is none.
const LookOption* look_of_others(const LookWords& look, std::span<const pipeline::faces::Face* const> faces);
/// A dataset's file has no look of its own.
proto::Result<void> check_look_of_store(const LookWords& look);
/// Opens the orthophoto. Problems: "usage", and those of open_orthophoto.
proto::Result<pipeline::faces::Look> look_of(const LookWords& words);
/// cordillera build. A dry run says what it found in any case.
int build_command(const Settings& settings, const BuildLine& line);
/// Says what a build of it would make. Nothing is written.
int dry_run(const pipeline::BuildRequest& request, Show show);

/// cordillera info: the manifest of a folder that build wrote or of a dataset's .sqlite file; of a raster, what it is and what a
/// build with these settings would make.
int info_command(const std::string& path, Show show, const Settings& settings, BadSource bad = BadSource::refuse);

/// cordillera decode: what a fetched .drc or .glb tile holds, counted after decoding.
int decode_command(const std::string& path);

struct CheckLine {
  std::string path;                  ///< a store, a dataset's folder, a static folder or a server's data folder
  std::vector<std::string> sources;  ///< the rasters it was built from, as they were named then, or none
  Show show = Show::table;
  Verbosity words = Verbosity::all;
};
/// cordillera check: whether datasets are what they say. The exit code says so too.
int check_command(const CheckLine& line);
/// cordillera adopt, vacuum, backup, restore: a server's data folder.
int adopt_command(const std::string& data);
int vacuum_command(const std::string& data, Orphans orphans, Verbosity words = Verbosity::all);
int backup_command(const std::string& data, const std::string& output, Verbosity words = Verbosity::all);
int restore_command(const std::string& from, const std::string& data, Verbosity words = Verbosity::all);

struct TokenWords {
  std::string action;  ///< new
  std::string name;
  std::string role;
  std::string file;  ///< where the line is added; empty: it is printed
};
/// cordillera token.
int token_command(const TokenWords& words);

/// One line to stderr.
void complain(const proto::Problem& problem);
/// The same, and the exit code for it: of what failed, of what was typed.
int fail(const proto::Problem& problem);
int wrong_usage(const proto::Problem& problem);
/// What a command said is to be on stdout before it ends: complains where it is not, as on a full disk, and has kFailed for
/// kDone.
int with_output(int code);

/// The manifest as a table a person reads.
std::string manifest_table(const proto::Manifest& manifest);
/// What a dry run found, as a table.
std::string estimate_table(const proto::Manifest& manifest, double seconds, const std::optional<raster::ValueLook>& values = {});

}  // namespace cordillera::server
