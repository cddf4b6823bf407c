#pragma once
// Places on the ellipsoid by their position in a tile's plan, between lattice vertices too.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "gpu/refine/refine.h"
#include "pipeline/bound/plan_point.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {

/// A place on the ellipsoid and which way is up there.
struct SurfacePoint {
  proto::Vec3 at, up;
  double tan_lat = 0;
};

/// A vertex in space.
struct Spot {
  proto::Vec3 at;
  double height_m = 0;
};

/// Frames of rows or columns that are asked for again and again: making one takes a sine, which costs as much as all that is done
/// with it.
template <class Frame>
class RememberedFrames {
 public:
  using Make = Frame (*)(const proto::Lattice&, std::int64_t index);
  RememberedFrames(const proto::Lattice& lattice, Make make) : lattice_(lattice), make_(make), entries_(kEntries) {}

  const Frame& at(std::int64_t index) const {
    Entry& entry = entries_[static_cast<std::size_t>(index) % kEntries];
    if (entry.index != index) entry = {index, make_(lattice_, index)};
    return entry.frame;
  }

 private:
  static constexpr std::size_t kEntries = 1024;
  struct Entry {
    std::int64_t index = INT64_MIN;
    Frame frame;
  };
  const proto::Lattice& lattice_;
  Make make_;
  mutable std::vector<Entry> entries_;
};

/// One thread's: it remembers.
class Earth {
 public:
  Earth(const proto::Lattice& lattice, const proto::TileAddress& tile)
      : west_(lattice.west(tile)),
        south_(lattice.south(tile)),
        cell_rad_(2 * kPi / static_cast<double>(lattice.columns())),
        rows_(lattice, proto::row_frame),
        columns_(lattice, proto::column_frame) {}

  // Between lattice vertices by the addition theorems from the vertex to the south-west: no library function of the fraction.
  SurfacePoint place(PlanPoint p) const {
    const double column = std::floor(p.x);
    const proto::ColumnFrame c = columns_.at(west_ + static_cast<std::int64_t>(column));
    proto::ColumnFrame here;
    turn(c.sin_lon, c.cos_lon, (p.x - column) * cell_rad_, here.sin_lon, here.cos_lon);
    if (p.y != parallel_.y) parallel_ = parallel_at(p.y);
    return {proto::ecef(parallel_.row, here, 0), proto::normal(parallel_.row, here), parallel_.tan_lat};
  }

  Spot at(const gpu::MeshPoint& p) const {
    const double height_m = p.height * proto::kHeightStep_m;
    return {proto::ecef(rows_.at(south_ + p.y), columns_.at(west_ + p.x), height_m), height_m};
  }

 private:
  static constexpr double kPi = 3.14159265358979323846;

  /// Places of a raster in degrees come parallel by parallel.
  struct Parallel {
    double y = NAN;
    proto::RowFrame row;
    double tan_lat = 0;
  };
  Parallel parallel_at(double y) const {
    const double row = std::floor(y);
    const proto::RowFrame r = rows_.at(south_ + static_cast<std::int64_t>(row));
    Parallel here{y, r};
    if (y > row) {
      turn(r.sin_lat, r.cos_lat, (y - row) * cell_rad_, here.row.sin_lat, here.row.cos_lat);
      const double e2 = proto::kFlattening * (2 - proto::kFlattening);
      const double n = proto::kSemiMajor_m / std::sqrt(1 - e2 * here.row.sin_lat * here.row.sin_lat);
      here.row.radius_m = n * here.row.cos_lat;
      here.row.axis_m = n * (1 - e2) * here.row.sin_lat;
    }
    here.tan_lat = std::abs(here.row.sin_lat) / std::max(here.row.cos_lat, 1e-6);
    return here;
  }

  // a + d for d of at most one cell (0.013 rad at the coarsest lattice): the series ends below 1e-16.
  static void turn(double sin_a, double cos_a, double d, double& sin_sum, double& cos_sum) {
    const double d2 = d * d;
    const double sin_d = d * (1 - d2 / 6 * (1 - d2 / 20 * (1 - d2 / 42)));
    const double cos_d = 1 - d2 / 2 * (1 - d2 / 12 * (1 - d2 / 30));
    sin_sum = sin_a * cos_d + cos_a * sin_d;
    cos_sum = cos_a * cos_d - sin_a * sin_d;
  }

  std::int64_t west_, south_;
  double cell_rad_;
  RememberedFrames<proto::RowFrame> rows_;
  RememberedFrames<proto::ColumnFrame> columns_;
  mutable Parallel parallel_;
};

}  // namespace cordillera::pipeline
