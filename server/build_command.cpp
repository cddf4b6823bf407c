// Raster -> store -> static folder, in this process: the operator's own file needs no fence around it.
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <iostream>

#include "pipeline/build.h"
#include "pipeline/export.h"
#include "server/child.h"
#include "server/commands.h"
#include "server/memory_limit.h"
#include "server/progress_bar.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

std::atomic<bool> g_stop{false};  // set by a signal handler, which can reach nothing else

int fail(const proto::Problem& problem) {
  complain(problem);
  return kFailed;
}

pipeline::BuildRequest request_for(const Settings& settings, const std::string& raster) {
  pipeline::BuildRequest request;
  const std::string file = fs::path(raster).filename().string();
  request.raster_path = raster;
  request.raster_name = settings.build.name().empty() ? file : settings.build.name();
  request.id = fs::path(request.raster_name).stem().string();
  request.options = settings.build;
  return request;
}

int dry_run(const pipeline::BuildRequest& request) {
  const auto estimate = pipeline::estimate(request);
  if (!estimate) return fail(estimate.problem());
  std::cout << estimate_table(estimate->manifest, estimate->seconds);
  return kDone;
}

proto::Result<proto::Manifest> build_store(const pipeline::BuildRequest& request) {
  on_out_of_memory(STDERR_FILENO, "\ncordillera: " + out_of_memory(request.options, request.raster_name).line() + "; what was built is kept\n");
  signal(SIGINT, [](int) { g_stop = true; });
  signal(SIGTERM, [](int) { g_stop = true; });
  ProgressBar bar;
  auto manifest = pipeline::build(
      request, [&](const proto::Progress& progress) { bar.show(progress); }, g_stop);
  bar.finish();
  return manifest;
}

proto::Result<void> export_to(const std::string& store, const fs::path& folder) {
  const auto reader = pipeline::StoreReader::open(store);
  if (!reader) return reader.problem();
  return pipeline::export_static(**reader, folder.string());
}

int build_folder(pipeline::BuildRequest request, const std::string& output) {
  // "out/" and "out" are one folder.
  fs::path place = fs::absolute(output).lexically_normal();
  if (!place.has_filename()) place = place.parent_path();
  if (const auto usable = pipeline::check_export_folder(place.string()); !usable) return fail(usable.problem());
  // Kept after a stop: the next run goes on there.
  const fs::path work = place.parent_path() / (place.filename().string() + ".building");
  std::error_code error;
  fs::create_directories(work, error);
  if (error) {
    return fail({"output-failed", "cannot create " + work.string() + ": " + error.message(), "a folder that can be written",
                 "--output"});
  }
  request.store_path = (work / kStoreFile).string();
  const auto manifest = build_store(request);
  if (!manifest) {
    if (manifest.problem().type != "cancelled") fs::remove_all(work, error);
    return fail(manifest.problem());
  }
  const auto done = export_to(request.store_path, place);
  fs::remove_all(work, error);
  if (!done) return fail(done.problem());
  std::cout << manifest_table(*manifest) << "written to " << place.string() << "\n";
  return kDone;
}

}  // namespace

int build_command(const Settings& settings, const std::string& raster, const std::string& output) {
  pipeline::BuildRequest request = request_for(settings, raster);
  limit_memory(request.options);
  if (settings.dry_run) return dry_run(request);
  if (!output.ends_with(".sqlite")) return build_folder(request, output);
  request.store_path = output;
  const auto manifest = build_store(request);
  if (!manifest) return fail(manifest.problem());
  std::cout << manifest_table(*manifest) << "written to " << output << "\n";
  return kDone;
}

}  // namespace cordillera::server
