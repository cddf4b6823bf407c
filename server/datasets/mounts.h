#pragma once
// Datasets that the operator published elsewhere: a file of this machine or of object storage, read where it lies and never written.
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/faces/terrain.h"
#include "raster/object_file.h"
#include "server/http/message.h"
#include "server/options/options.h"
#include "server/datasets/registry.h"

namespace cordillera::server {

/// Thread-safe.
class Mounts {
 public:
  explicit Mounts(const Settings& settings);

  bool has(const std::string& name) const { return places_.contains(name); }
  std::optional<Dataset> find(const std::string& name) const;
  std::vector<Dataset> list() const;

  /// The dataset as it is there now; looks every few seconds whether another one has been published in its place. A reader that was handed
  /// out stays of its version. "storage-unreachable" when it cannot be read; asked again after a pause.
  proto::Result<std::shared_ptr<const pipeline::faces::Terrain>> open(const std::string& name);
  /// A reader threw. None: another dataset may have been published meanwhile; opening again gives that one.
  std::optional<proto::Problem> after_failure(const std::string& name);

 private:
  using Time = std::chrono::steady_clock::time_point;
  struct Place {
    std::string path;
    std::string created;  ///< when the service began to know of it
    bool is_private = false;
    std::mutex mutex;
    std::shared_ptr<raster::ObjectFile> file;
    std::shared_ptr<const pipeline::faces::Terrain> terrain;
    Time looked{};                         ///< whether it is still the same
    std::optional<proto::Problem> problem;  ///< of the last attempt to open it
    Time tried{};
  };
  void look_again(const std::string& name, Place& place);
  static Dataset dataset_of(const std::string& name, const Place& place);

  std::shared_ptr<raster::BlockCache> cache_;
  std::map<std::string, std::unique_ptr<Place>> places_;  ///< never changes
};

/// The answer that read gives. Once more if the dataset was replaced in its middle, and the problem if its storage fails.
Response of_mount(Mounts& mounts, const std::string& name, const std::function<Response()>& read);

}  // namespace cordillera::server
