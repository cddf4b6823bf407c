#pragma once
// What a check of a dataset found, and how much it looked at.
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace cordillera::pipeline::check {

struct Finding {
  std::string where;  ///< "tile 10/617/763", "level 10", "blob 3f…"
  std::string what;
};

/// A damaged disk may break every tile: all are counted, the first ones kept.
class Findings {
 public:
  void add(std::string where, std::string what) {
    if (++count_ <= kMostKept) kept_.push_back({std::move(where), std::move(what)});
  }
  std::uint64_t count() const { return count_; }
  const std::vector<Finding>& kept() const { return kept_; }

 private:
  static constexpr std::uint64_t kMostKept = 100;
  std::uint64_t count_ = 0;
  std::vector<Finding> kept_;
};

struct Report {
  Findings findings;
  std::uint64_t checksums = 0;     ///< bytes held against the hash that names them
  std::uint64_t tiles = 0;         ///< decoded both ways
  std::uint64_t borders = 0;       ///< sides of tiles compared with the neighbour's
  std::uint64_t measured = 0;      ///< tiles held against the raster
  std::uint64_t unmeasured = 0;    ///< tiles that cover too many samples for that
  std::uint64_t unreferenced = 0;  ///< blobs that no tile names: no harm, `vacuum` takes them out
  bool sound() const { return findings.count() == 0; }
};

}  // namespace cordillera::pipeline::check
