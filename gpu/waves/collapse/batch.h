#pragma once
// All tiles of a batch as one mesh in the memory of a device. Only the input goes there and only the survivors come back.
#include <span>
#include <stdexcept>
#include <vector>

#include "gpu/simplify.h"
#include "gpu/waves/collapse/batch_steps.h"

namespace cordillera::gpu {

/// What is left of a tile. Vertices are numbered anew over the whole batch, in their old order.
struct Survivors {
  std::span<const std::uint32_t> original;   ///< vertex of the batch as it came
  const std::uint32_t* row_start = nullptr;  ///< indexed by survivor of the tile, one more at the end: its place in `neighbour`
  const std::uint32_t* neighbour = nullptr;  ///< new numbers, as in a row of rings.h
  std::uint32_t first = 0;                   ///< new number of the tile's first survivor
  std::uint32_t first_original = 0;
};

template <class Device>
class Batch {
 public:
  explicit Batch(Device& device) : device_(device) {}

  /// To the device.
  void load(std::span<const SimplifyJob> jobs, const ParallelFor& parallel);
  /// There: what the first pass finds.
  void start(std::span<const SimplifyJob> jobs);
  /// The vertices that are left, ascending. all: none has gone yet.
  std::span<const std::uint32_t> alive(bool all);
  /// Brings the survivors to the host; the batch is at its end.
  void unload();
  Survivors survivors(std::size_t tile) const;

  const MeshView& view() const { return view_; }
  std::uint32_t row_width() const { return row_width_; }  ///< that no ring of the batch outgrows in the waves
  TileFinder tiles() const { return {given_.number ? numbered_tiles_.data() : given_tiles_.data(), tiles_.size()}; }

 private:
  template <class T>
  using Array = typename Device::template Array<T>;
  template <class T>
  using Staging = typename Device::template Staging<T>;
  using Triangle = std::array<std::uint32_t, 3>;

  void stage(std::span<const SimplifyJob> jobs, const ParallelFor& parallel);
  void stage_triangles(const proto::TileMesh& mesh, std::size_t tile);
  void choose();
  template <class Step>
  void over_points(const SparseStart& start, std::int32_t half, std::int32_t most_cells, const Step& step) {
    const OverPoints<Step> points{start, static_cast<std::uint32_t>(tiles_.size()), half, most_cells, step};
    device_.each(points.count(Device::kInStep), points);
  }
  void chain_rings(std::span<const SimplifyJob> jobs);
  template <class T>
  T* upload(Array<T>& array, const Staging<T>& from, std::size_t count) {
    array.reserve(count);
    device_.copy_in(array.data(), from.data(), count);
    return array.data();
  }
  template <class T>
  T* room(Array<T>& array, std::size_t count) {
    array.reserve(count);
    return array.data();
  }

  Device& device_;
  std::vector<BatchTile> tiles_;
  std::vector<std::size_t> triangle_first_;  // indexed by tile, one more at the end; grids have none
  std::size_t given_count_ = 0, vertices_ = 0, survivors_count_ = 0;
  std::uint32_t row_width_ = 0;
  BatchGiven given_;
  MeshView view_;

  Array<BatchTile> given_tiles_, numbered_tiles_;
  Array<std::int32_t> given_x_, given_y_;
  Array<float> given_elevation_;
  Array<std::uint8_t> given_mark_, stays_;
  Array<std::uint32_t> kept_, number_, given_survivors_;
  Array<std::int32_t> x_, y_;
  Array<float> elevation_, carried_, spent_;
  Array<std::uint32_t> key_, row_, window_, alive_, row_start_, valences_, neighbour_, wedge_end_;
  Array<std::uint16_t> local_;
  Array<std::uint8_t> valence_, mark_;
  Array<RingFacts> facts_;
  Array<Triangle> triangles_;
  Array<Wedge> wedges_;

  Staging<std::int32_t> host_x_, host_y_;
  Staging<float> host_elevation_;
  Staging<std::uint8_t> host_mark_;
  Staging<Triangle> host_triangles_;
  Staging<std::uint32_t> host_survivors_, host_row_start_, host_neighbour_;
};

}  // namespace cordillera::gpu
