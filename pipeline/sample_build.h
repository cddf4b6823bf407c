#pragma once
// A few tiles of a dataset, built for real to know what all of it will be.
#include <atomic>
#include <memory>
#include <vector>

#include "pipeline/builder.h"
#include "pipeline/workers.h"

namespace cordillera::pipeline {

struct LevelSum {
  double tiles = 0, triangles = 0, drc = 0, glb = 0, valid = 0;
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

/// Builders side by side: a place is one tile, which keeps one thread busy. On a GPU, and for blocks, there is one with all threads.
class Hands {
 public:
  Hands(const proto::Plan& plan, unsigned threads, Builder::OpenSource open, std::string device)
      : plan_(plan), open_(std::move(open)), device_(std::move(device)), threads_(threads) {}
  proto::Result<void> prepare();
  std::string device() const { return builders_.front()->device(); }
  void use(const proto::Plan& plan) {
    for (const auto& builder : builders_) builder->use(plan);
  }
  /// Each node's tiles, indexed as nodes.
  std::vector<proto::Result<FinishedTask>> blocks(const std::vector<proto::TileAddress>& nodes);

 private:
  proto::Result<void> add(unsigned threads);

  const proto::Plan& plan_;
  Builder::OpenSource open_;
  std::string device_;
  unsigned threads_;
  const std::atomic<bool> never_ = false;
  std::vector<std::unique_ptr<Workers>> workers_;   ///< indexed as builders_
  std::vector<std::unique_ptr<Builder>> builders_;
  std::unique_ptr<Workers> side_by_side_;
};

/// Builds samples below nodes: all of them where the dataset is small, else single tiles and some with the level above.
class Sampler {
 public:
  /// nodes: see filled_nodes(); of the block level where the dataset is small. Both outlive this.
  Sampler(Hands& hands, const std::vector<proto::TileAddress>& nodes) : hands_(hands), nodes_(nodes) {}
  /// With the plan's targets. Deterministic but for the seconds.
  proto::Result<Sampled> build(const proto::Plan& plan);

 private:
  proto::Result<void> build_places(const proto::Plan& plan, std::size_t most, Sampled& sampled);
  proto::Result<void> build_parents(const proto::Plan& plan, Sampled& sampled);

  Hands& hands_;
  const std::vector<proto::TileAddress>& nodes_;
  std::vector<std::pair<double, proto::TileAddress>> found_;  ///< triangles of each place that has some
};

}  // namespace cordillera::pipeline
