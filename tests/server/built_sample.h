#pragma once
// A service with the shipped sample as it is really built.
#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "fixture.h"
#include "pipeline/build/build.h"

namespace cordillera::server {

/// The shipped sample.
inline const std::string kRaster = std::string(CORDILLERA_SOURCE_DIR) + "/deploy/sample/white_mountains_srtm3.tif";

/// Builds in this process: what the child would do, without the child.
inline proto::Result<std::optional<proto::Estimate>> build_job(const std::filesystem::path& folder, const ProgressSink&,
                                                               const std::atomic<bool>& stop) {
  proto::Job job;
  if (!from_json(file_text(folder / kJobFile), &job)) return proto::Problem{"internal", "no job", "", ""};
  pipeline::BuildRequest request;
  request.raster_path = (folder / job.raster()).string();
  request.raster_name = job.name();
  request.id = job.id();
  request.store_path = (folder / kStoreFile).string();
  request.options = job.options();
  const auto built = pipeline::build(request, nullptr, stop);
  if (!built) return built.problem();
  return std::optional<proto::Estimate>();
}

/// A service with one dataset, built once for all tests of a program.
class Built {
 public:
  Built() {
    Settings settings;
    settings.serve.data = (folder_.path() / "data").string();
    settings.serve.web = (folder_.path() / "web").string();
    service_ = std::move(Service::open(settings, build_job).value());
    api_ = std::make_unique<Api>(*service_);
    base_ = post(file_text(kRaster), {{"name", "sample.tif"}, {"error", "4"}, {"device", "cpu"}, {"threads", "2"}});
  }
  /// A dataset's address, once it is built.
  std::string post(const std::string& body, const decltype(Request::query)& query) {
    Request request;
    request.method = "POST";
    request.path = "/v1/datasets";
    request.query = query;
    request.headers = {{"content-length", std::to_string(body.size())}, {"prefer", "wait=600"}};
    request.read_body = [&](const Request::Sink& sink) { return sink(body); };
    const Response response = TestService::settled(api_->handle(request));
    if (response.status != 201) throw std::runtime_error(response.body);
    return "/v1/datasets/" + body_of(response)["id"].get<std::string>();
  }
  Api& api() { return *api_; }
  Service& service() { return *service_; }
  std::filesystem::path data() const { return folder_.path() / "data"; }
  const std::string& base() const { return base_; }

 private:
  TempFolder folder_;
  std::unique_ptr<Service> service_;
  std::unique_ptr<Api> api_;
  std::string base_;
};
inline Built& built() {
  static Built kBuilt;
  return kBuilt;
}

}  // namespace cordillera::server
