#include <signal.h>

#include <filesystem>
#include <iostream>
#include <memory>

#include "pipeline/exports/export.h"
#include "pipeline/work/publish.h"
#include "pipeline/work/work_plan.h"
#include "proto/paths.h"
#include "raster/disk/file_lock.h"
#include "raster/disk/private_folder.h"
#include "raster/storage/storage.h"
#include "server/cli/export_command.h"
#include "server/cli/path_kind.h"
#include "server/cli/work_commands.h"
#include "server/sandbox/asked_to_stop.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
namespace work = pipeline::work;
using proto::Problem;

/// Of a problem that the words of the command line may have.
int wrong_line(const Problem& problem) { return problem.type == "usage" ? wrong_usage(problem) : give_up(problem); }

/// What the output's name says is written.
enum class Written : std::uint8_t { folder, dataset, exported };
Written written_as(const std::string& output) {
  if (output.ends_with(".sqlite")) return Written::dataset;
  return is_export_name(output) ? Written::exported : Written::folder;
}

/// What can be said of the line before its plan is read.
proto::Result<void> check_publish(const PublishLine& line) {
  const Written written = written_as(line.output);
  if (line.output.empty())
    return Problem{"usage", "publish needs to know where to write",
                   "-o FOLDER, -o FILE.sqlite, or a name that export writes, such as -o FILE.pmtiles", "--output"};
  if (raster::is_remote(line.output) && written != Written::dataset)
    return Problem{"usage", "in object storage a dataset is one object", "a name that ends in .sqlite: /vsis3/BUCKET/NAME.sqlite",
                   "--output"};
  if (written == Written::exported) return check_export(export_line(line));
  if (written == Written::folder)
    return means_another_file(line.output) ? no_such_file("publish", line.output) : check_look(line.look, line.formats);
  return check_look_of_store(line.look);
}

/// The folder that the output lies in: of a folder it is made, as build makes it; of a file it must be there, as for export.
proto::Result<void> prepare_parent(const PublishLine& line, const fs::path& place) {
  const std::string parent = place.parent_path().string();
  std::error_code error, missing;
  if (written_as(line.output) == Written::folder) fs::create_directories(parent, error);
  if (!error && fs::is_directory(parent, missing)) return {};
  const std::string why = error ? "cannot create " + parent + ": " + error.message() : "there is no folder " + parent;
  return Problem{"output-failed", place.string() + " cannot be written: " + why, "a place in a folder that can be written",
                 "--output"};
}

/// What is in the output's place may stay, or be replaced.
proto::Result<void> check_place(const PublishLine& line, const fs::path& place) {
  const bool remote = raster::is_remote(line.output);
  std::error_code error;
  if (written_as(line.output) == Written::folder) return pipeline::check_export_folder(place.string(), line.other);
  const bool there = remote ? raster::size_of(line.output).has_value() : fs::exists(place, error);
  if (there && line.other == pipeline::Existing::refuse) return pipeline::output_exists(line.output + " is there already");
  return {};
}

/// A folder, an archive or a mesh of a store that is removed then.
proto::Result<void> export_from(const std::string& store, const PublishLine& line, const pipeline::faces::Look& look,
                                const fs::path& place) {
  const auto exported = [&]() -> proto::Result<void> {
    if (written_as(line.output) == Written::exported) {
      ExportLine told = export_line(line);
      told.source = store;
      const auto said = export_file(told);
      return said ? proto::Result<void>() : said.problem();
    }
    return export_folder(store, line, look, place, 0);
  }();
  std::error_code error;
  fs::remove(store, error);
  return exported;
}

}  // namespace

int publish_command(const PublishLine& line) {
  if (const auto possible = check_publish(line); !possible) return wrong_line(possible.problem());
  const auto look = look_of(line.look);
  if (!look) return wrong_line(look.problem());
  const auto plan = work::read_plan(line.folder);
  if (!plan) return give_up(plan.problem());
  const bool remote = raster::is_remote(line.output);
  raster::remove_left_folders();
  // Put together here before it is sent on: an object cannot be changed in its middle.
  const std::unique_ptr<raster::PrivateFolder> elsewhere = remote ? std::make_unique<raster::PrivateFolder>() : nullptr;
  if (remote && !elsewhere->made()) {
    return give_up({"storage-write", "no folder can be made in " + fs::temp_directory_path().string(),
                    "a TMPDIR with room for the dataset", ""});
  }
  const fs::path place = proto::place_of(remote ? elsewhere->place("dataset.sqlite") : line.output);
  if (const auto prepared = prepare_parent(line, place); !prepared) return give_up(prepared.problem());
  const raster::FileLock lock(place.string() + ".publishing.lock");
  if (lock.others()) return give_up(at_work_there(place.string()));
  if (const auto usable = check_place(line, place); !usable) return give_up(usable.problem());
  const bool whole = written_as(line.output) == Written::dataset;
  const std::string store = whole ? place.string() : place.string() + ".publishing.sqlite";
  stop_on({SIGINT, SIGTERM, SIGHUP}, SecondTime::ends);
  const auto manifest = work::publish(*plan, line.folder, store, g_asked_to_stop);
  if (!manifest) return give_up(manifest.problem());
  if (!whole) {
    if (const auto exported = export_from(store, line, *look, place); !exported) return give_up(exported.problem());
  }
  if (remote) {
    if (const auto sent = raster::upload_file(store, line.output); !sent) return give_up(sent.problem());
  }
  if (line.words == Verbosity::all)
    std::cout << manifest_table(*manifest) << "written to " << (remote ? line.output : place.string()) << "\n";
  if (line.prune) {
    const auto removed = work::prune(*plan, line.folder);
    if (!removed) return give_up(removed.problem());
    if (line.words == Verbosity::all) std::cout << counted(*removed, "shard") << " of other plans removed\n";
  }
  return kDone;
}

}  // namespace cordillera::server
