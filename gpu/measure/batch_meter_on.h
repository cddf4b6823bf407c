#pragma once
// The driver of BatchMeter, of steps over arrays that a Device runs (see gpu/device/host_steps.h):
//   measure(n, step)   step(i, lanes) for i in 0..n-1, with as many lanes as the device likes
//   use()              before a call
#include <algorithm>
#include <utility>
#include <vector>

#include "gpu/measure/batch_meter.h"
#include "gpu/measure/measure_triangle.h"
#include "gpu/measure/surface_memory.h"
#include "gpu/measure/surface_meter.h"
#include "gpu/measure/tile_triangles.h"

namespace cordillera::gpu {

proto::Result<std::unique_ptr<BatchMeter>> make_cuda_batch_meter(int device);

template <class Device>
class BatchMeterOn final : public BatchMeter {
 public:
  explicit BatchMeterOn(std::unique_ptr<Device> device) : device_(std::move(device)) {}

  void measure(std::span<const SurfaceErrorInput> tiles, double limit_m, std::span<SurfaceMemory> memories) override {
    device_->use();
    std::vector<std::size_t> first{0};  // triangle, of each tile
    for (const SurfaceErrorInput& tile : tiles) first.push_back(first.back() + tile.mesh->triangles.size());
    const std::size_t count = first.back();
    if (count == 0) return;
    load(*tiles.front().lattice, *tiles.front().samples);
    metered_.resize(tiles.size());
    asked_.resize(count), found_.resize(count);
    for (std::size_t k = 0; k < tiles.size(); ++k) {
      metered_[k] = metered(tiles[k]);
      ask(*tiles[k].mesh, k, asked_.data() + first[k], memories[k]);
    }
    step_.tiles = upload(tiles_, metered_.data(), metered_.size());
    step_.asked = upload(device_asked_, asked_.data(), count);
    device_found_.reserve(count);
    step_.found = device_found_.data();
    device_->measure(count, step_);
    device_->copy_out(found_.data(), step_.found, count);
    for (std::size_t k = 0; k < tiles.size(); ++k) {
      for (std::size_t t = 0; t < memories[k].triangles.size(); ++t) {
        if (asked_.data()[first[k] + t].tile != AskedTriangle::kNone)
          remember(found_.data()[first[k] + t], limit_m, memories[k].triangles[t]);
      }
    }
  }

 private:
  /// A group of a GPU's lanes takes about a millisecond for so many samples.
  static constexpr std::int64_t kMostSamples = 1 << 17;

  template <class T>
  using Array = typename Device::template Array<T>;

  template <class T>
  T* upload(Array<T>& array, const T* from, std::size_t count) {
    array.reserve(count);
    device_->copy_in(array.data(), from, count);
    return array.data();
  }

  void load(const proto::Lattice& lattice, const proto::Samples& samples) {
    rows_ = proto::row_frames(lattice, samples.south, static_cast<std::size_t>(samples.rows));
    columns_ = proto::column_frames(lattice, samples.west, static_cast<std::size_t>(samples.columns));
    step_.samples = upload(samples_, samples.height.data(), samples.height.size());
    step_.columns = samples.columns;
    step_.row_frame = upload(row_frames_, rows_.data(), rows_.size());
    step_.column_frame = upload(column_frames_, columns_.data(), columns_.size());
  }

  static MeteredTile metered(const SurfaceErrorInput& in) {
    const SampleWindow window(in, in.mesh->side);
    MeteredTile tile;
    tile.facts = tile_facts(in, height_range_m(*in.mesh));
    tile.rows = window.rows();
    tile.row_shift = window.row_shift();
    std::copy(window.stretches().begin(), window.stretches().end(), tile.stretch);
    return tile;
  }

  /// asked: of the mesh's triangles, of tile k.
  void ask(const proto::TileMesh& mesh, std::size_t k, AskedTriangle* asked, SurfaceMemory& memory) const {
    const TileTriangles triangles(mesh);
    memory.triangles.resize(mesh.triangles.size());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      asked[t].tile = AskedTriangle::kNone;
      if (!triangles.is_published(t)) continue;
      SurfaceMemory::Triangle& known = memory.triangles[t];
      known.corners = triangles.corners(t);
      if (!goes_there(metered_[k], known.corners)) continue;
      known.owned = triangles.owned_edges(t, known.corners);
      std::copy(known.corners.begin(), known.corners.end(), asked[t].corners);
      asked[t].owned = known.owned;
      asked[t].tile = static_cast<std::uint32_t>(k);
    }
  }
  static bool goes_there(const MeteredTile& tile, const std::array<MeshPoint, 3>& corners) {
    const auto holds = [](const Span& span, std::int64_t at) { return at >= span.first && at <= span.last; };
    for (const MeshPoint& p : corners) {
      if (!holds(tile.rows, p.y)) return false;
      if (!holds(tile.stretch[0].columns, p.x) && !holds(tile.stretch[1].columns, p.x)) return false;
    }
    const auto [west, east] = std::minmax({corners[0].x, corners[1].x, corners[2].x});
    const auto [south, north] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
    return (std::int64_t{east} - west + 1) * (std::int64_t{north} - south + 1) <= kMostSamples;
  }
  static void remember(const FoundTriangle& found, double limit_m, SurfaceMemory::Triangle& known) {
    if (found.error_m > limit_m) return;
    known.error_m = found.error_m;
    known.floor_m = -1;  // known, however small
    known.sums = {found.covered, found.summed, found.overcovered, found.squares};
  }

  std::unique_ptr<Device> device_;
  MeasureTriangle step_;
  std::vector<proto::RowFrame> rows_;  // lent to copies that may not be done yet
  std::vector<proto::ColumnFrame> columns_;
  std::vector<MeteredTile> metered_;
  std::vector<AskedTriangle> asked_;
  std::vector<FoundTriangle> found_;
  Array<std::int32_t> samples_;
  Array<proto::RowFrame> row_frames_;
  Array<proto::ColumnFrame> column_frames_;
  Array<MeteredTile> tiles_;
  Array<AskedTriangle> device_asked_;
  Array<FoundTriangle> device_found_;
};

}  // namespace cordillera::gpu
