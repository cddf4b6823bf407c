#pragma once
// What a client reads before any tile of a static folder: tileset.json, and subtrees that say which tiles there are.
// https://docs.ogc.org/cs/22-025r4/22-025r4.html#toc77 (subtree file format)
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
  /// A tile that is there: its subtree must say so.
  void add(const proto::TileAddress& tile);

 private:
  const std::vector<bool>& contents_of(const std::string& subtree);

  std::filesystem::path folder_;
  Report& report_;
  bool is_implicit_ = true;
  std::map<std::string, std::vector<bool>> contents_;  ///< by file, in availability order; empty: it is no subtree
};

}  // namespace cordillera::pipeline::check
