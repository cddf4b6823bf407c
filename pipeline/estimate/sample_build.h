#pragma once
// A few tiles of a dataset, built for real to know what all of it will be.
#include <vector>

#include "pipeline/build/builder.h"

namespace cordillera::pipeline {

struct LevelSum {
  double tiles = 0, triangles = 0, drc = 0, valid = 0;
};

/// What was built at the sample places, indexed by levels above the finest.
struct Sampled {
  std::vector<LevelSum> levels;
  double samples = 0;      ///< lattice samples of the places
  double all_samples = 0;  ///< of all nodes that may hold data
  double cpu_seconds = 0;
  std::size_t places = 0, filled = 0, all_places = 0;

  double scale() const { return samples > 0 ? all_samples / samples : 0; }
};

/// So few tiles that all blocks are built, levels inside them included.
bool is_small(const proto::Plan& plan);

/// Builds samples below nodes: all of them where the dataset is small, else single tiles and some with the level above.
class Sampler {
 public:
  /// nodes: see filled_nodes(); of the block level where the dataset is small. All outlive this.
  Sampler(Builder& builder, const std::vector<proto::TileAddress>& nodes) : builder_(builder), nodes_(nodes) {}
  /// With the plan's targets. Deterministic but for the seconds.
  proto::Result<Sampled> build(const proto::Plan& plan);

 private:
  proto::Result<void> build_places(const proto::Plan& plan, std::size_t most, Sampled& sampled);
  proto::Result<void> build_parents(const proto::Plan& plan, Sampled& sampled);

  /// Each node's tiles, in the order of nodes, with this plan's targets and block level.
  proto::Result<std::vector<FinishedTask>> blocks(const proto::Plan& plan, const std::vector<proto::TileAddress>& nodes);

  Builder& builder_;
  const std::vector<proto::TileAddress>& nodes_;
  int block_level_ = 0;                                       ///< of a build: nodes of other levels are samples, each for itself
  std::vector<std::pair<double, proto::TileAddress>> found_;  ///< triangles of each place that has some
};

}  // namespace cordillera::pipeline
