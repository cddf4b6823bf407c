// Raster -> store -> static folder, in this process: the operator's own file needs no fence around it.
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <iostream>
#include <system_error>

#include "pipeline/build/build.h"
#include "pipeline/estimate/estimate.h"
#include "pipeline/exports/export.h"
#include "pipeline/exports/whole_file.h"
#include "pipeline/faces/tilejson.h"
#include "pipeline/faces/tiles_3d/photo_texture.h"
#include "pipeline/faces/web_mercator.h"
#include "proto/paths.h"
#include "raster/disk/file_lock.h"
#include "raster/disk/private_folder.h"
#include "raster/place/area.h"
#include "raster/source.h"
#include "server/api/estimate_json.h"
#include "server/cli/commands.h"
#include "server/cli/export_command.h"
#include "server/cli/path_kind.h"
#include "server/cli/progress_bar.h"
#include "server/cli/sources.h"
#include "server/cli/stage_times.h"
#include "server/jobs/child.h"
#include "server/memory/memory_limit.h"
#include "server/sandbox/asked_to_stop.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

/// Of several rasters: the folder's that they lie in, else the output's, without the ending of a file.
std::string name_of_several(const BuildLine& line) {
  std::error_code error;
  if (line.rasters.size() == 1 && fs::is_directory(line.rasters.front(), error))
    return proto::place_of(line.rasters.front()).filename().string();
  const fs::path name = proto::place_of(line.output).filename();
  return (line.output.ends_with(".sqlite") || is_export_name(line.output) ? name.stem() : name).string();
}

proto::Result<pipeline::BuildRequest> request_for(const Settings& settings, const BuildLine& line) {
  auto request = request_of(line.rasters, settings, line.bad);
  if (!request) return request;
  if (!request->members.empty() && !line.output.empty()) request->raster_name = name_of_several(line);  // a dry run needs none
  if (!settings.build.name().empty()) request->raster_name = settings.build.name();
  request->id = fs::path(request->raster_name).stem().string();
  return request;
}

proto::Result<proto::Manifest> build_store(const pipeline::BuildRequest& request, Verbosity words, StageTimes& times) {
  on_out_of_memory(STDERR_FILENO,
                   "\ncordillera: " + out_of_memory(request.options, request.raster_name).line() + "; what was built is kept\n");
  stop_on({SIGINT, SIGTERM, SIGHUP}, SecondTime::ends);
  ProgressBar bar(ProgressBar::style_of(words == Verbosity::all));
  const auto show = [&](const proto::Progress& progress) {
    times.enter(progress.stage());
    bar.show(progress);
  };
  try {
    auto manifest = pipeline::build(request, show, g_asked_to_stop);
    bar.finish();
    return manifest;
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::resource_unavailable_try_again) throw;
    bar.finish();
    return out_of_memory(request.options, request.raster_name);  // a thread that cannot be made
  }
}

int done(const proto::Manifest& manifest, const std::string& place, Verbosity words, StageTimes& times) {
  if (words == Verbosity::all)
    std::cout << manifest_table(manifest) << "took      " << times.text() << "\nwritten to " << place << "\n";
  return kDone;
}

/// What is said of a stop, where a store was begun that is kept for the next run.
proto::Problem with_way_on(proto::Problem problem, const fs::path& store) {
  std::error_code error;
  if (problem.type == pipeline::kCancelled.type && fs::exists(store, error))
    problem.detail += "; the same line goes on from what was built";
  return problem;
}

/// Writes what the store holds to its place.
using Exports = std::function<proto::Result<void>(const std::string& store)>;

/// A store beside the place, for as long as it takes to make that of it.
int build_beside(pipeline::BuildRequest request, const BuildLine& line, const fs::path& place, const Exports& exports) {
  // Kept after a stop: the next run goes on there.
  const fs::path work = place.parent_path() / (place.filename().string() + ".building");
  std::error_code error;
  fs::create_directories(work, error);
  if (error) {
    return fail(
        {"output-failed", "cannot create " + work.string() + ": " + error.message(), "a folder that can be written", "--output"});
  }
  const raster::FileLock lock(work.string() + ".lock");
  if (lock.others()) return fail(at_work_there(place.string()));
  const bool begun = fs::exists(work / kStoreFile, error);
  request.store_path = (work / kStoreFile).string();
  StageTimes times;
  const auto manifest = build_store(request, line.words, times);
  if (!manifest) {
    // What an earlier run has done is not this one's to throw away: it may belong to another build.
    const bool ours = !begun || line.other == pipeline::Existing::replace;
    const bool goes_on = manifest.problem().type == "cancelled" || manifest.problem().type == "memory-limit";
    if (!goes_on && ours) fs::remove_all(work, error);
    return fail(with_way_on(manifest.problem(), request.store_path));
  }
  times.enter("export");
  const auto exported = exports(request.store_path);
  if (exported || exported.problem().type != pipeline::exports::kStopped.type) fs::remove_all(work, error);
  if (!exported) return fail(with_way_on(exported.problem(), request.store_path));
  return done(*manifest, place.string(), line.words, times);
}

int build_folder(pipeline::BuildRequest request, const BuildLine& line, const pipeline::faces::Look& look) {
  if (means_another_file(line.output)) {
    fail(no_such_file("build", line.output));
    return kUsage;
  }
  const fs::path place = proto::place_of(line.output);
  if (const auto usable = pipeline::check_export_folder(place.string(), line.other); !usable) return fail(usable.problem());
  const unsigned threads = request.options.threads();
  return build_beside(std::move(request), line, place,
                      [&](const std::string& store) { return export_folder(store, line, look, place, threads); });
}

/// An archive or a mesh: what export writes.
int build_exported(pipeline::BuildRequest request, const BuildLine& line) {
  ExportLine told = export_line(line);
  if (is_archive_name(line.output)) told.threads = std::to_string(request.options.threads());
  if (const auto usable = check_export(told); !usable) {
    const int code = fail(usable.problem());
    return usable.problem().type == "usage" ? kUsage : code;
  }
  return build_beside(std::move(request), line, fs::absolute(line.output).lexically_normal(),
                      [&](const std::string& store) -> proto::Result<void> {
                        told.source = store;
                        const auto said = export_file(told);
                        return said ? proto::Result<void>() : said.problem();
                      });
}

/// One file. A finished build in its place is refused here, an unfinished one where the plan is known.
int build_file(pipeline::BuildRequest request, const BuildLine& line) {
  if (line.other == pipeline::Existing::refuse && pipeline::StoreReader::open(line.output)) {
    return fail(pipeline::output_exists(line.output + " holds an earlier build"));
  }
  request.store_path = line.output;
  request.old_stays = true;
  StageTimes times;
  const auto manifest = build_store(request, line.words, times);
  if (manifest) return done(*manifest, line.output, line.words, times);
  return fail(with_way_on(manifest.problem(), line.output));
}

/// Whether a format is asked for that has nothing but tiles of Web Mercator.
bool wants_mercator(const BuildLine& line) {
  using namespace pipeline::faces;
  if (line.output.ends_with(".sqlite")) return false;
  const auto is_one = [](const Face* face) { return face != nullptr && is_of_maps(*face); };
  if (!is_export_name(line.output)) return std::any_of(line.formats.begin(), line.formats.end(), is_one);
  return is_one(face_in_archive(line.output, line.only_format));
}

/// What would be refused in the end is told before hours of work: an orthophoto of another place, and maps of the poles.
proto::Result<void> check_before(const pipeline::BuildRequest& request, const BuildLine& line,
                                 const pipeline::faces::Look& look) {
  const bool mercator = wants_mercator(line);
  if (!look.photo && !mercator) return {};
  const auto source = pipeline::open_source(request);
  if (!source) return source.problem();
  const auto data = raster::area_of((*source)->description().bbox());
  if (data && mercator && pipeline::faces::is_beyond_mercator(*data)) return pipeline::faces::beyond_mercator();
  return data && look.photo ? pipeline::faces::check_photo(*look.photo, *data) : proto::Result<void>();
}

}  // namespace

int dry_run(const pipeline::BuildRequest& request, Show show) {
  const auto estimate = pipeline::estimate(request);
  if (!estimate) return fail(estimate.problem());
  std::cout << (show == Show::json ? dump(estimate_json(estimate->manifest, estimate->seconds)) + "\n"
                                   : estimate_table(estimate->manifest, estimate->seconds, estimate->values));
  return kDone;
}

int build_command(const Settings& settings, const BuildLine& line) {
  for (const std::string& warning : settings.build.warnings()) std::cerr << "cordillera: warning: " << warning << "\n";
  const auto look = look_of(line.look);
  if (!look) {
    const int code = fail(look.problem());
    return look.problem().type == "usage" ? kUsage : code;
  }
  raster::remove_left_folders();
  auto asked = request_for(settings, line);
  if (!asked) return fail(asked.problem());
  pipeline::BuildRequest request = std::move(*asked);
  request.other = line.other;
  limit_memory(request.options);
  if (const auto shown = check_before(request, line, *look); !shown) return fail(shown.problem());
  if (settings.dry_run) return dry_run(request, line.show);
  if (line.output.ends_with(".sqlite")) return build_file(request, line);
  return is_export_name(line.output) ? build_exported(std::move(request), line) : build_folder(std::move(request), line, *look);
}

}  // namespace cordillera::server
