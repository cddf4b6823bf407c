#pragma once
// The samples on a device.
#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

/// The input's surface at the nodes of a lattice; of a triangle, the nodes in it.
struct ResampleTriangle {
  const Vertex* vertex;
  const Triangle* triangles;
  float* z;
  std::int32_t columns;
  int step_shift;  ///< nodes are 1 << step_shift units apart

  CORDILLERA_HD void operator()(std::size_t i) const {
    const Triangle& t = triangles[i];
    const Vertex &a = vertex[t[0]], &b = vertex[t[1]], &c = vertex[t[2]];
    const std::int32_t before = (1 << step_shift) - 1;
    const std::int32_t west = (least(a.x, least(b.x, c.x)) + before) >> step_shift,
                       east = greatest(a.x, greatest(b.x, c.x)) >> step_shift;
    const std::int32_t south = (least(a.y, least(b.y, c.y)) + before) >> step_shift,
                       north = greatest(a.y, greatest(b.y, c.y)) >> step_shift;
    const float inverse = 1 / static_cast<float>(turn(a.at(), b.at(), c.at()));
    for (std::int32_t row = south; row <= north; ++row) {
      for (std::int32_t column = west; column <= east; ++column) {
        const Point p{column << step_shift, row << step_shift};
        const std::int64_t e0 = turn(b.at(), c.at(), p), e1 = turn(c.at(), a.at(), p), e2 = turn(a.at(), b.at(), p);
        if ((e0 | e1 | e2) < 0) continue;
        if ((e0 == 0 && !left(b, c)) || (e1 == 0 && !left(c, a)) || (e2 == 0 && !left(a, b))) continue;
        z[static_cast<std::int64_t>(row) * columns + column] =
            a.z + (static_cast<float>(e1) * (b.z - a.z) + static_cast<float>(e2) * (c.z - a.z)) * inverse;
      }
    }
  }

 private:
  CORDILLERA_HD static bool left(const Vertex& from, const Vertex& to) {
    return leans_left(to.x - from.x, to.y - from.y, std::uint8_t{0});
  }
};

/// What the resampled surface is off at the samples of a bin.
struct CompareBin {
  ScatteredSamples samples;
  float* off;

  CORDILLERA_HD void operator()(std::size_t bin) const {
    float most = 0;
    for (std::uint32_t i = samples.start[bin]; i < samples.start[bin + 1]; ++i) {
      const float surface = samples.surface(samples.point[i]);
      if (surface == kNoSample) continue;
      const float above = samples.z[i] - surface, size = above < 0 ? -above : above;
      most = size > most ? size : most;
    }
    off[bin] = most;
  }
};

template <class Device>
class SampleStore {
 public:
  explicit SampleStore(Device& device) : device_(device) {}

  /// After the mesh has been loaded, whose border decides how samples lean.
  LatticeSamples lattice(const Plan& plan, WorkMesh<Device>& work) {
    LatticeSamples samples{work.upload(z_, plan.lattice_z), nullptr, plan.columns, plan.rows};
    samples.lean = lean(samples, plan.lattice_z.size(), work);
    return samples;
  }

  /// Room for the samples of a grid.
  float* grid_room(std::size_t count, WorkMesh<Device>& work) { return work.room(z_, count); }
  /// After the mesh has been loaded, and the samples with it.
  LatticeSamples grid(const HeightGrid& grid, WorkMesh<Device>& work) {
    LatticeSamples samples{z_.data(), nullptr, static_cast<std::int32_t>(grid.columns), static_cast<std::int32_t>(grid.rows)};
    samples.lean = lean(samples, work.ids(), work);
    return samples;
  }

  ScatteredSamples scattered(const Plan& plan, WorkMesh<Device>& work) {
    ScatteredSamples samples;
    samples.z = work.upload(z_, plan.z);
    samples.point = work.upload(point_, plan.at);
    samples.start = work.upload(start_, plan.bin_start);
    samples.columns = plan.bin_columns;
    samples.bin_shift = plan.bin_shift;
    samples.lean = lean(samples, plan.z.size(), work);
    resample(plan, work, samples);
    return samples;
  }

 private:
  template <class T>
  using Array = typename Device::template Array<T>;

  template <class Samples>
  const std::uint8_t* lean(const Samples& samples, std::size_t count, WorkMesh<Device>& work) {
    std::uint8_t* const lean = work.room(lean_, count);
    device_.zero(lean, count);
    device_.each(work.ids(), LeanInwards<Samples>{work.mesh(), samples, lean});
    return lean;
  }

  /// Nodes a bin apart.
  void resample(const Plan& plan, WorkMesh<Device>& work, ScatteredSamples& samples) {
    samples.raster_shift = plan.bin_shift - 4;
    samples.raster.columns = plan.bin_columns + 1;
    samples.raster.rows = plan.bin_rows + 1;
    const std::size_t nodes = static_cast<std::size_t>(samples.raster.columns) * static_cast<std::size_t>(samples.raster.rows);
    float* const z = work.upload(raster_, std::vector<float>(nodes, kNoSample));
    samples.raster.z = z;
    const Triangle* const triangles = work.upload(triangles_, plan.triangles);
    device_.each(plan.triangles.size(),
                 ResampleTriangle{work.mesh().vertex, triangles, z, samples.raster.columns, plan.bin_shift});
    const std::size_t bins = static_cast<std::size_t>(plan.bin_columns) * static_cast<std::size_t>(plan.bin_rows);
    float* const off = work.room(off_, bins);
    device_.each(bins, CompareBin{samples, off});
    samples.off = off;
  }

  Device& device_;
  Array<float> z_, raster_, off_;
  Array<std::uint8_t> lean_;
  Array<Point> point_;
  Array<std::uint32_t> start_;
  Array<Triangle> triangles_;
};

}  // namespace cordillera::gpu::fit
