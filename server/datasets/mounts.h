#pragma once
// Datasets that the operator published elsewhere: a file of this machine or of object storage, or a folder of finished tiles;
// read where it lies and never written.
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/faces/terrain.h"
#include "raster/storage/object_file.h"
#include "server/datasets/registry.h"
#include "server/http/message.h"
#include "server/options/options.h"

namespace cordillera::server {

/// Why the service cannot begin with these mounts: what lies on this machine must be there and be a finished dataset. An object
/// storage may come later.
std::optional<proto::Problem> refuse_mounts(const std::vector<Mount>& mounts);

/// Thread-safe.
class Mounts {
 public:
  explicit Mounts(const Settings& settings);

  bool has(const std::string& name) const { return places_.contains(name); }
  /// Null: none is called so.
  Row find(const std::string& name) const;
  std::vector<Row> list() const;

  /// The folder of one that `build -o FOLDER/` wrote: its files are the answers, and open() refuses. Empty of any other dataset,
  /// mounted or not.
  std::string folder(const std::string& name) const;
  /// "storage-unreachable" when it cannot be read.
  proto::Result<proto::Manifest> manifest(const std::string& name);

  /// The dataset as it is there now; looks every few seconds whether another one has been published in its place. A reader that
  /// was handed out stays of its version. "storage-unreachable" when it cannot be read; asked again after a pause.
  proto::Result<std::shared_ptr<const pipeline::faces::Terrain>> open(const std::string& name);
  /// A reader threw. None: another dataset may have been published meanwhile; opening again gives that one.
  std::optional<proto::Problem> after_failure(const std::string& name);

 private:
  using Time = std::chrono::steady_clock::time_point;
  struct Place {
    std::string path;
    bool is_folder = false;
    Row row;  ///< created: when the service began to know of it
    std::mutex mutex;
    std::shared_ptr<raster::ObjectFile> file;
    std::shared_ptr<const pipeline::faces::Terrain> terrain;
    Time looked{};                          ///< whether it is still the same
    std::optional<proto::Problem> problem;  ///< of the last attempt to open it
    Time tried{};
  };
  void look_again(const std::string& name, Place& place);

  std::shared_ptr<raster::BlockCache> cache_;
  std::map<std::string, std::unique_ptr<Place>> places_;  ///< never changes
};

/// The answer that read gives. Once more if the dataset was replaced in its middle, and the problem if its storage fails.
Response of_mount(Mounts& mounts, const std::string& name, const std::function<Response()>& read);

}  // namespace cordillera::server
