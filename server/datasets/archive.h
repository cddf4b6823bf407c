#pragma once
// Earlier versions of datasets, open while somebody reads them: who began below a version's address goes on there.
#include <cstdint>
#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <string>

#include "pipeline/faces/terrain.h"
#include "pipeline/store/store_words.h"
#include "server/data/layout.h"

namespace cordillera::server::updates {

/// Thread-safe. A reader that was handed out outlives its file.
class Archive {
 public:
  explicit Archive(Layout layout) : layout_(std::move(layout)) {}
  /// The version that has this name (version_of its manifest): a kept one, or one under the words that the dataset had; null:
  /// none.
  std::shared_ptr<const pipeline::faces::Terrain> find(const std::string& id, const std::string& version);
  /// The kept version of that number; null: it cannot be read.
  std::shared_ptr<const pipeline::faces::Terrain> open(const std::string& id, std::uint32_t number);
  void forget(const std::string& id);

 private:
  /// name: what it is called here.
  std::shared_ptr<const pipeline::faces::Terrain> open_as(const std::string& id, const std::string& name,
                                                          const std::filesystem::path& store, const pipeline::Words& words);
  std::shared_ptr<const pipeline::faces::Terrain> find_under_other_words(const std::string& id, const std::string& version);

  struct Open {
    std::string id, name;
    std::shared_ptr<const pipeline::faces::Terrain> terrain;
  };
  Layout layout_;
  std::mutex mutex_;
  std::list<Open> open_;  ///< the last used first
};

}  // namespace cordillera::server::updates
