// Raster -> store -> static folder, in this process: the operator's own file needs no fence around it.
#include <signal.h>

#include <atomic>
#include <filesystem>
#include <iostream>

#include "pipeline/build.h"
#include "pipeline/export.h"
#include "server/child.h"
#include "server/commands.h"
#include "server/json.h"
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
  std::cout << manifest_table(estimate->manifest) << "dry run: nothing was built; the numbers are estimates, time about "
            << static_cast<long>(estimate->seconds + 0.5) << " s\n";
  return kDone;
}

/// What must not be overwritten: a folder with something in it that no build of ours wrote.
std::optional<proto::Problem> check_output(const fs::path& output) {
  std::error_code error;
  if (!fs::exists(output, error)) return std::nullopt;
  const bool ours = fs::is_directory(output, error) && (fs::is_empty(output, error) || fs::exists(output / "manifest.json", error));
  if (ours) return std::nullopt;
  return proto::Problem{"output-occupied", output.string() + " holds something that no build wrote",
                        "a new or empty folder, or one that an earlier build wrote", "--output"};
}

/// The finished folder takes the place of an older one in one step.
proto::Result<void> put_in_place(const fs::path& finished, const fs::path& output) {
  std::error_code error;
  fs::remove_all(output, error);
  if (!error) fs::rename(finished, output, error);
  if (!error) return {};
  return proto::Problem{"output-failed", "cannot write " + output.string() + ": " + error.message(), "a folder that can be written",
                        "--output"};
}

proto::Result<proto::Manifest> build_store(const pipeline::BuildRequest& request) {
  signal(SIGINT, [](int) { g_stop = true; });
  signal(SIGTERM, [](int) { g_stop = true; });
  ProgressBar bar;
  auto manifest = pipeline::build(request, [&](const proto::Progress& progress) { bar.show(progress); }, g_stop);
  bar.finish();
  return manifest;
}

proto::Result<void> export_to(const std::string& store, const fs::path& folder) {
  const auto reader = pipeline::StoreReader::open(store);
  if (!reader) return reader.problem();
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  return pipeline::export_static(**reader, folder.string());
}

int build_folder(pipeline::BuildRequest request, const std::string& output) {
  // "out/" and "out" are one folder.
  fs::path place = fs::absolute(output).lexically_normal();
  if (!place.has_filename()) place = place.parent_path();
  if (auto occupied = check_output(place)) return fail(*occupied);
  // Beside the output, so that the finished folder can be renamed into its place. Kept after a stop: the next run goes on there.
  const fs::path work = place.parent_path() / (place.filename().string() + ".building");
  std::error_code error;
  fs::create_directories(work, error);
  if (error) return fail({"output-failed", "cannot create " + work.string() + ": " + error.message(), "a folder that can be written", "--output"});
  request.store_path = (work / kStoreFile).string();
  const auto manifest = build_store(request);
  if (!manifest) {
    if (manifest.problem().type != "cancelled") fs::remove_all(work, error);
    return fail(manifest.problem());
  }
  auto done = export_to(request.store_path, work / "static");
  if (done) done = put_in_place(work / "static", place);
  fs::remove_all(work, error);
  if (!done) return fail(done.problem());
  std::cout << manifest_table(*manifest) << "written to " << place.string() << "\n";
  return kDone;
}

}  // namespace

int build_command(const Settings& settings, const std::string& raster, const std::string& output) {
  pipeline::BuildRequest request = request_for(settings, raster);
  if (settings.dry_run) return dry_run(request);
  if (!output.ends_with(".sqlite")) return build_folder(request, output);
  request.store_path = output;
  const auto manifest = build_store(request);
  if (!manifest) return fail(manifest.problem());
  std::cout << manifest_table(*manifest) << "written to " << output << "\n";
  return kDone;
}

}  // namespace cordillera::server
