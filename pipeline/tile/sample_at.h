#pragma once
// A window's sample at a vertex of the lattice, which goes around the earth.
#include <cstdint>

#include "proto/integers.h"
#include "proto/lattice.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// kNoHeight where there is no data, or outside of the window. Columns are taken modulo the circle.
inline std::int32_t sample_at(const proto::Samples& samples, const proto::Lattice& lattice, std::int64_t i, std::int64_t j) {
  i = samples.west + proto::modulo(i - samples.west, lattice.columns());
  const bool there = i < samples.west + samples.columns && j >= samples.south && j < samples.south + samples.rows;
  return there ? samples.at(i, j) : proto::kNoHeight;
}

}  // namespace cordillera::pipeline
