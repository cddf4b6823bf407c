#pragma once
// A published store under other words than it was built with: a typing error in a title costs no build.
#include <memory>
#include <optional>
#include <string>

#include "pipeline/store/store.h"

namespace cordillera::pipeline {

/// nullopt: that of the build stays. An empty title: the name stands for it.
struct Words {
  std::optional<std::string> title, attribution, imagery;
  bool operator==(const Words&) const = default;
};

/// Into a manifest, as a build with these options would have written them.
void put_words(const Words& words, proto::Manifest& manifest);

/// As StoreReader::open; the manifest and every .glb say these words. Tiles are otherwise the same bytes.
proto::Result<std::unique_ptr<StoreReader>> open_store_with(const std::string& path, const Words& words);

}  // namespace cordillera::pipeline
