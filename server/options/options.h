#pragma once
// The tables of what a build, a POST and a service take.
#include <algorithm>
#include <string>
#include <vector>

#include "cordillera.pb.h"
#include "proto/cores.h"
#include "proto/result.h"
#include "server/options/table_reader.h"

namespace cordillera::server {

/// What one service takes on at most. GET /v1/limits shows it.
struct Limits {
  std::uint32_t body_mib = 16384;            ///< of a posted raster
  std::uint32_t megapixels = 20000;          ///< of a posted raster
  std::uint32_t side = 1000000;              ///< pixels along a side of it
  std::uint32_t datasets = 10000;            ///< kept at the same time
  std::uint32_t queue = 100;                 ///< builds that wait for their turn
  std::uint32_t uploads = 64;                ///< at the same time
  std::uint32_t client_uploads = 8;          ///< of one token or address
  std::uint32_t build_seconds = 86400;       ///< of one build, whatever its raster
  std::uint32_t build_base_seconds = 600;    ///< of one build; and beside them
  std::uint32_t build_seconds_per_mib = 60;  ///< for each MiB of its rasters
  std::uint32_t cache_mib = 16384;           ///< on disk, of what was fetched or made because somebody read it; 0: no limit
  std::uint32_t free_percent = 5;            ///< of the disk, that posting leaves
  std::uint32_t connections = 4096;          ///< at the same time; beyond them the longest idle one makes room
  std::uint32_t client_connections = 512;    ///< of one address
  /// Threads that read and write connections; no option, but few descriptors lower it.
  std::uint32_t loops = std::clamp(proto::usable_cores(), 1u, 16u);
  std::uint32_t open_datasets = 64;       ///< at the same time; no option, but few descriptors lower it
  std::uint32_t open_archives = 16;       ///< that nobody reads; no option, but few descriptors lower it
  std::uint32_t client_streams = 64;      ///< event streams and waiting requests of one address
  std::uint32_t wait_seconds = 10;        ///< that a request may wait for a tile which is still to be made
  std::uint32_t unsent_mib = 512;         ///< of large answers that clients have yet to read; what several share counts once
  std::uint32_t client_unsent_mib = 128;  ///< of one address
  std::uint32_t min_rate = 1024;          ///< bytes a second, of bodies and of readers
  std::uint32_t answer_seconds = 600;     ///< that a reader may keep the server waiting, however large the answer
  std::uint32_t head_seconds = 10;        ///< for the head of a request
  std::uint32_t idle_seconds = 60;        ///< of a connection without a request
};

/// A dataset that was published elsewhere.
struct Mount {
  std::string name;  ///< its id
  std::string path;  ///< a .sqlite file here or in object storage
};

/// What only the service needs.
struct ServeSettings {
  std::string listen = "127.0.0.1:8080";
  std::string data = "cordillera-data";
  std::string web;         ///< folder of the viewer; empty: beside the program
  std::string geoids;      ///< folders, separated by colons, whose grids a request may name as vertical_datum
  std::uint32_t jobs = 1;  ///< builds that run at the same time
  std::string log_level = "info";
  std::string log_format = "text";
  std::string tokens;                        ///< file of who may write; empty: none
  std::string token_lines;                   ///< the same without a file
  std::string audit_log;                     ///< empty: audit.jsonl in the data folder
  bool insecure_writes = false;              ///< without tokens, beyond loopback
  std::vector<std::string> trusted_proxies;  ///< whose X-Forwarded-For is believed
  std::vector<Mount> mounts;
  std::string live;                       ///< a folder whose rasters are datasets; empty: none
  std::uint32_t cache_mib = 256;          ///< of what was read of mounts
  std::uint32_t keep_versions = 1;        ///< earlier ones of a dataset whose rasters change
  std::vector<std::string> source_allow;  ///< beginnings of addresses that rasters may be fetched from
  std::uint32_t live_fresh_seconds = 60;  ///< that a raster of an address counts as the same without asking
  bool live_open = false;                 ///< who may read may have rasters fetched by their address
  Limits limits;
};

/// Everything that options can say.
struct Settings {
  proto::BuildOptions build;
  bool dry_run = false;
  bool private_dataset = false;  ///< read with a token only
  ServeSettings serve;
};

using OptionSpec = OptionOf<Settings>;

/// What a build takes, over HTTP and on the command line alike.
const std::vector<OptionSpec>& build_options();
/// The options among these that each of several rasters may have for itself.
std::vector<OptionSpec> raster_options();
/// What only a POST takes, and `serve` as its default.
const std::vector<OptionSpec>& posting_options();
/// What a POST takes: options of the build, and those of posting.
std::vector<OptionSpec> post_options();
/// What only `serve` takes.
const std::vector<OptionSpec>& serve_options();
/// All: `serve` takes those of a POST as the defaults of its requests.
std::vector<OptionSpec> all_options();

/// One of serve_options() that GET /v1/limits shows.
struct LimitOption {
  OptionSpec option;
  std::uint32_t Limits::*field;
  std::string unit;
};
const std::vector<LimitOption>& limit_options();

/// What no option of a build can refuse alone: error and keep replace each other between layers, and within one layer they are a
/// contradiction; a least level above the finest. given: the layer that the settings have taken last.
std::optional<proto::Problem> check_together(const Settings& settings, const Given& given, Spelling spelling);
/// Earlier versions took nodata=hole and nodata=fill for what voids= says now, and had strategy=waves; build gets a warning.
Given in_present_words(Given given, Spelling spelling, proto::BuildOptions& build);

/// Reads a table with options of a build or a service among its rows, and checks what they say together. settings: those of the
/// wish. Problems as read_options.
template <class Wish>
std::optional<proto::Problem> read_layer(const std::vector<OptionOf<Wish>>& table, const Given& given, Spelling spelling,
                                         Wish& wish, Settings& settings) {
  const Given present = in_present_words(given, spelling, settings.build);
  if (auto problem = read_options(table, present, {.spelling = spelling}, wish)) return problem;
  return check_together(settings, given, spelling);
}

/// Puts a layer over settings, and checks them. An unknown name, a repeated one or a bad value is a Problem that names it and
/// what is accepted.
proto::Result<Settings> with_layer(Settings settings, const std::vector<OptionSpec>& table, const Given& given,
                                   Spelling spelling);

/// A raster's voids are filled with those of all, or not at all: voids=fill and voids=hole cannot be said of one. As a query has
/// it.
bool is_of_all_rasters(const std::string& name, const std::string& value);
/// "option-invalid" of the first that cannot be said of one raster.
std::optional<proto::Problem> check_raster_layer(const Given& given);
/// A layer for one raster of several, whose options stand over those of all.
proto::Result<Settings> with_raster_layer(Settings settings, const std::vector<OptionSpec>& table, const Given& given);
/// The same of what a list says of a raster, which has no name of its own; with or without the command line's dashes in front.
/// called: the raster, for problems.
proto::Result<proto::BuildOptions> with_listed_layer(const Settings& settings, const Given& given, const std::string& called);

/// The variables of the table that are set in this process's environment.
Given environment_layer(const std::vector<OptionSpec>& table);

/// A sentence for each variable CORDILLERA_... of this process's environment that nobody reads.
std::vector<std::string> unread_variables();

/// Lines of `name = value`; # starts a comment; a value may stand in double quotes.
proto::Result<Given> config_file_layer(const std::string& path);

}  // namespace cordillera::server
