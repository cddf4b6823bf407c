#pragma once
// Earlier versions of datasets, open while somebody reads them: who began below a version's address goes on there.
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>

#include "pipeline/faces/terrain.h"
#include "server/data/layout.h"

namespace cordillera::server::updates {

/// Thread-safe. A reader that was handed out outlives its file.
class Archive {
 public:
  explicit Archive(Layout layout) : layout_(std::move(layout)) {}
  /// The kept version that has this name (version_of its manifest); null: none.
  std::shared_ptr<const pipeline::faces::Terrain> find(const std::string& id, const std::string& version);
  /// The kept version of that number; null: it cannot be read.
  std::shared_ptr<const pipeline::faces::Terrain> open(const std::string& id, std::uint32_t number);
  void forget(const std::string& id);

 private:
  struct Open {
    std::string id;
    std::uint32_t number;
    std::shared_ptr<const pipeline::faces::Terrain> terrain;
  };
  Layout layout_;
  std::mutex mutex_;
  std::list<Open> open_;  ///< the last used first
};

}  // namespace cordillera::server::updates
