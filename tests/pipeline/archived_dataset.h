#pragma once
// The dataset that archives are made of, and what its faces give.
#include <map>
#include <string>
#include <vector>

#include "pipeline/faces/face.h"
#include "tests/pipeline/exports_dataset.h"

namespace cordillera::pipeline::testing {

using faces::Face;

/// Four tiles of the finest level: each is a picture of every style, made several times.
inline const ExportDataset& archived_dataset() {
  static const ExportDataset kDataset(hills(), {7, 127, 82}, {7, 128, 83});
  return kDataset;
}

inline std::vector<std::string> paths_of(const Face& face) {
  std::vector<std::string> paths;
  face.each_path(archived_dataset().terrain(), [&](const std::string& path) { paths.push_back(path); });
  return paths;
}

/// Made once: several archives hold the same pictures.
inline const std::string& face_bytes(const std::string& path) {
  static std::map<std::string, std::string> known;
  const auto [at, is_new] = known.try_emplace(path);
  if (is_new) {
    const auto found = faces::find(path);
    auto made = found->resource->make(archived_dataset().terrain(), found->place);
    at->second = made.ok() && *made ? std::string((*made)->bytes) : "nothing at " + path;
  }
  return at->second;
}

}  // namespace cordillera::pipeline::testing
