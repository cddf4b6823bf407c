#pragma once
// What a raster says at the vertices of its finest level, for checks that ask of each place several times.
#include <cstdint>
#include <memory>
#include <utility>

#include "proto/lru.h"
#include "proto/result.h"
#include "raster/source.h"

namespace cordillera::pipeline::check {

/// Two laws ask for each tile's samples, the tiles beside it for its rim, and every coarser level for all of them again. They are
/// kept in squares, 100 million of them: those of a raster that has no more are made once. Of a raster so wide that three rows of
/// squares have no room none are kept.
class KnownSamples {
 public:
  /// source: outlives this.
  KnownSamples(raster::Source& source, const proto::Lattice& lattice);

  /// As Source::sample at the window's vertices.
  proto::Result<proto::Samples> sample(const raster::Source::Window& window);

 private:
  using Square = std::shared_ptr<const proto::Samples>;
  proto::Result<Square> square(std::int64_t column, std::int64_t row);

  raster::Source& source_;
  proto::Lattice lattice_;
  bool keeps_;
  proto::Lru<std::pair<std::int64_t, std::int64_t>, Square> squares_;  ///< by column and row of squares
};

}  // namespace cordillera::pipeline::check
