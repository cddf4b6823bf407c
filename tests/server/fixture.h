#pragma once
// A service on a folder of its own. Its jobs are played: what the posted "raster" says decides how the build goes.
//   GOOD…  a store with two tiles        BAD…   a problem            SLOW…  runs until it is stopped
//   LOST…  the GPU is lost, the CPU works  CRASH… the child's end by a signal, as the real runner tells it
//   LIVE…  provisional tiles, then waits for a file "go" or "fail" in the dataset's folder
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "pipeline/store/store.h"
#include "server/api/api.h"
#include "server/http/json.h"
#include "tests/sanitized.h"

namespace cordillera::server {

/// A test says itself what it sets: nothing of the caller's may reach the program, and no proxy lies before 127.0.0.1.
inline const bool kOwnEnvironment = [] {
  std::vector<std::string> names;
  for (char** variable = environ; *variable != nullptr; ++variable) names.emplace_back(*variable, strcspn(*variable, "="));
  for (const std::string& name : names) {
    const bool where = name == "CORDILLERA_CACHE" || name == "CORDILLERA_TEST_DATA";
    if (name.rfind("CORDILLERA_", 0) == 0 && !where) unsetenv(name.c_str());
  }
  for (const char* name : {"no_proxy", "NO_PROXY"}) setenv(name, "*", 1);
  return true;
}();

/// Longer than the slowest machine needs: what a test waits for ends the wait, and the time never decides.
inline constexpr auto kPatience = std::chrono::minutes(kSanitized ? 20 : 4);

/// Whether it came to hold.
template <class Condition>
bool eventually(const Condition& holds) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

class TempFolder {
 public:
  TempFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "cordillera-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TempFolder() {
    std::error_code ignored;  // a process that was killed may still be ending
    std::filesystem::remove_all(path_, ignored);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline std::string file_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

inline pipeline::EncodedTile test_tile(std::uint32_t level, std::uint32_t x, std::uint32_t y) {
  pipeline::EncodedTile tile;
  tile.record.set_level(level);
  tile.record.set_x(x);
  tile.record.set_y(y);
  tile.record.set_triangles(2);
  for (const double value : {-1.5, 0.1, -0.1, 0.7, 0.0, 100.0}) tile.record.add_region(value);  // radians, within both tiles
  tile.drc = "drc of " + std::to_string(level);
  tile.glb = "glb of " + std::to_string(level);
  tile.record.set_drc_bytes(static_cast<std::uint32_t>(tile.drc.size()));
  tile.record.set_glb_bytes(static_cast<std::uint32_t>(tile.glb.size()));
  return tile;
}

/// Levels 0 and 1, a tile each, in the western hemisphere. Of provisional tiles level 0 alone, with other bytes; block_level: of
/// a build that shows its blocks one by one, none as yet.
inline void make_store(const std::string& path, const std::string& id, bool provisional = false,
                       std::optional<std::uint32_t> block_level = {}) {
  proto::Plan plan;
  plan.set_finest_level(provisional && !block_level ? 0 : 1);
  for (const std::uint32_t level : {1u, 0u}) {
    if (level <= plan.finest_level()) plan.add_levels()->set_level(level);
  }
  auto writer = pipeline::StoreWriter::open(path, plan);
  if (!writer) throw std::runtime_error(writer.problem().line());
  pipeline::FinishedTask task;
  if (!provisional) task.tiles.push_back(test_tile(1, 1, 1));
  task.tiles.push_back(test_tile(0, 0, 0));
  if (provisional) task.tiles[0].drc = "provisional drc of 0";
  if (auto done = (*writer)->commit(task); !done) throw std::runtime_error(done.problem().line());
  proto::Manifest manifest;
  manifest.set_id(id);
  manifest.set_name("test");
  manifest.set_attribution("Somebody");
  manifest.set_max_level(plan.finest_level());
  manifest.set_provisional(provisional);
  if (block_level) manifest.mutable_done_blocks()->set_level(*block_level);
  for (const double value : {-90.0, 0.0, -10.0, 45.0, 0.0, 100.0}) manifest.add_bounds(value);
  if (auto done = (*writer)->publish(manifest); !done) throw std::runtime_error(done.problem().line());
}

inline proto::Result<std::optional<proto::Estimate>> play_job(const std::filesystem::path& folder, const ProgressSink& progress,
                                                              const std::atomic<bool>& stop) {
  proto::Job job;
  if (!from_json(file_text(folder / kJobFile), &job)) return proto::Problem{"internal", "no job", "", ""};
  const std::string raster = file_text(folder / job.raster());
  proto::Progress step;
  step.set_stage("build");
  step.set_total(10);
  step.set_done(3);
  step.set_seconds_left(7);
  if (progress) progress(step);
  if (raster.rfind("BAD", 0) == 0) return proto::Problem{"raster-unreadable", job.name() + " is no raster", "GeoTIFF", ""};
  if (raster.rfind("CRASH", 0) == 0) return proto::Problem{"job-crashed", "ended by signal SIGSEGV", "", ""};
  if (raster.rfind("LOST", 0) == 0 && job.options().device() != "cpu")
    return proto::Problem{"device-lost", "the GPU is gone", "", ""};
  if (raster.rfind("LIVE", 0) != 0 && job.dry_run() && job.provisional()) return std::optional<proto::Estimate>();
  if (raster.rfind("LIVE", 0) == 0 && job.provisional()) {
    std::filesystem::remove(folder / kNextProvisional);  // of an attempt that was ended
    make_store((folder / kNextProvisional).string(), job.id(), true);
    std::filesystem::rename(folder / kNextProvisional, folder / kProvisionalStore);
    step.set_provisional(true);
    if (progress) progress(step);
  }
  if (job.dry_run() && job.provisional()) return std::optional<proto::Estimate>();  // a first look
  while (raster.rfind("LIVE", 0) == 0 && !std::filesystem::exists(folder / "go")) {
    if (stop) return proto::Problem{"cancelled", "cancelled", "", ""};
    if (std::filesystem::exists(folder / "fail"))
      return proto::Problem{"raster-unreadable", "damaged behind its beginning", "GeoTIFF", ""};
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  while (raster.rfind("SLOW", 0) == 0) {
    if (stop) return proto::Problem{"cancelled", "cancelled", "", ""};
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (job.dry_run()) {
    proto::Estimate estimate;
    estimate.set_seconds(12);
    estimate.mutable_manifest()->set_tiles(99);
    estimate.mutable_manifest()->mutable_source()->set_columns(7);
    estimate.mutable_manifest()->add_levels()->set_target(3);
    *estimate.mutable_manifest()->mutable_options() = job.options();
    return std::optional(estimate);
  }
  // As a real job: nobody sees a store that is half written.
  make_store((folder / "made.sqlite").string(), job.id());
  std::filesystem::rename(folder / "made.sqlite", folder / kStoreFile);
  return std::optional<proto::Estimate>();
}

/// A service with played jobs.
class TestService {
 public:
  explicit TestService(Settings settings = {}, JobRunner runner = play_job) : runner_(std::move(runner)) {
    settings.serve.data = (folder_.path() / "data").string();
    if (settings.build.attribution().empty()) settings.build.set_attribution("Somebody");  // as make_store has it
    settings.serve.web = (folder_.path() / "web").string();
    settings_ = settings;
    start();
  }
  void start() {
    auto opened = Service::open(settings_, runner_);
    if (!opened) throw std::runtime_error(opened.problem().line());
    service_ = std::move(opened.value());
    api_ = std::make_unique<Api>(*service_);
  }
  void stop() {
    api_.reset();
    service_.reset();
  }
  Api& api() { return *api_; }
  Service& service() { return *service_; }
  const Settings& settings() const { return settings_; }
  std::filesystem::path data() const { return settings_.serve.data; }
  std::filesystem::path folder() const { return folder_.path(); }

  Response get(const std::string& path, const std::map<std::string, std::string>& headers = {}) {
    Request request;
    request.path = path;
    request.headers = headers;
    return plain(api_->handle(request));
  }
  Response send(const std::string& method, const std::string& path) {
    Request request;
    request.method = method;
    request.path = path;
    return api_->handle(request);
  }
  Response post(const std::string& body, const Given& query = {}, std::map<std::string, std::string> headers = {}) {
    Request request;
    request.method = "POST";
    request.path = "/v1/datasets";
    request.query = query;
    headers.emplace("content-length", std::to_string(body.size()));
    request.headers = headers;
    request.read_body = [body](const Request::Sink& sink) {
      for (std::size_t i = 0; i < body.size(); i += 3) {
        if (!sink(std::string_view(body).substr(i, 3))) return false;
      }
      return true;
    };
    return settled(api_->handle(request));
  }
  /// With a body of its own where it would share one.
  static Response plain(Response response) {
    if (response.shared) response.body = *response.shared;
    return response;
  }
  /// An answer that was still to come, once it has.
  static Response settled(Response response) {
    eventually([&] {
      if (!response.later) return true;
      if (auto come = response.later(Patience::more)) response = std::move(*come);
      if (response.rest) response = response.rest();
      return !response.later;
    });
    return plain(std::move(response));
  }
  /// Files and folders below data/incoming and data/datasets. A folder that goes while it is counted is gone.
  std::size_t leftovers() const {
    std::size_t count = 0;
    for (const char* name : {"incoming", "datasets"}) {
      std::error_code error;
      std::filesystem::recursive_directory_iterator at(data() / name, error);
      for (; !error && at != end(at); at.increment(error)) ++count;
    }
    return count;
  }

 private:
  TempFolder folder_;
  JobRunner runner_;
  Settings settings_;
  std::unique_ptr<Service> service_;
  std::unique_ptr<Api> api_;
};

inline Json body_of(const Response& response) { return Json::parse(response.bytes()); }
inline std::string slug_of(const Response& response) {
  const std::string type = body_of(response).value("type", "");
  return type.substr(type.rfind(':') + 1);
}

/// As a client asks that wants to see the end.
inline const std::map<std::string, std::string> kWait = {{"prefer", "wait=200"}};

inline std::string posted_id(const Response& response) { return body_of(response)["id"]; }

}  // namespace cordillera::server
