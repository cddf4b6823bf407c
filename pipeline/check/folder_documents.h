#pragma once
// What a client reads before any tile of a static folder: tileset.json, and subtrees that say which tiles there are.
// https://docs.ogc.org/cs/22-025r4/22-025r4.html#toc77 (subtree file format)
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "pipeline/check/report.h"
#include "proto/lattice.h"

namespace cordillera::pipeline::check {

class FolderDocuments {
 public:
  /// A finding where tileset.json names no tiles. A folder of tileset-explicit.json alone has no subtrees. The report is
  /// borrowed.
  FolderDocuments(std::filesystem::path folder, Report& report);
  /// A tile that is there: its subtree must say so, and the subtree above that must say that there is this one.
  void add(const proto::TileAddress& tile);

  /// What a subtree file names; of a file that is none both are empty.
  struct Subtree {
    std::vector<bool> contents;  ///< tiles that a client finds, in availability order
    std::vector<bool> children;  ///< subtrees below, in Morton order
  };

 private:
  /// Where a subtree's root stands in the implicit tileset.
  struct Root {
    char hemisphere = 'W';
    int z = 0;
    std::int32_t x = 0, y = 0;
    std::string file() const;
  };
  const Subtree& subtree_of(const Root& root);
  void find_from_above(const Root& root);

  std::filesystem::path folder_;
  Report& report_;
  bool is_implicit_ = true;
  std::map<std::string, Subtree> subtrees_;  ///< by file
};

}  // namespace cordillera::pipeline::check
