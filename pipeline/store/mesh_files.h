#pragma once
// What blocks leave for the levels above them, in files beside a store that is being written: megabytes a block that are gone
// when it is published. In the store itself each would be written twice, and its pages would have to be given back at the end.
#include <optional>
#include <string>

#include "proto/lattice.h"

namespace cordillera::pipeline {

/// The folder STORE-meshes. It comes with the first file. Failures throw StoreError. One thread at a time for a node.
class MeshFiles {
 public:
  explicit MeshFiles(const std::string& store_path) : folder_(folder_of(store_path)) {}
  static std::string folder_of(const std::string& store_path) { return store_path + "-meshes"; }

  /// The file is on the disk, whole, when this returns; one of an earlier attempt is replaced.
  void put(const proto::TileAddress& node, const std::string& bytes);
  bool has(const proto::TileAddress& node) const;
  std::optional<std::string> get(const proto::TileAddress& node) const;  ///< none: there is no such file
  void drop(const proto::TileAddress& node) noexcept;
  void drop_all() noexcept;

 private:
  std::string path_of(const proto::TileAddress& node) const;

  const std::string folder_;
};

/// Removes a store and what lies beside it while it is written; says nothing where that cannot be.
void remove_store(const std::string& path);

}  // namespace cordillera::pipeline
