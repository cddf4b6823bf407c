// What a level has become: its triangles, their errors, the meshes; included by engine.inl only.
#include <algorithm>
#include <bit>
#include <cmath>

#include "gpu/exact/engine.h"

namespace cordillera::gpu::exact {

inline constexpr std::size_t kRunsWanted = 8192, kPartsWanted = std::size_t{1} << 20;  ///< of triangles, when they are measured

template <class Executor>
std::size_t Engine<Executor>::list_triangles(const OwnTriangles& own) {
  executor_->each(vertices_ + 1, CountTriangles{own, vertices_, count_.data()});
  executor_->exclusive_sum(count_.data(), number_.data(), vertices_ + 1);
  std::uint32_t triangles = 0;
  executor_->copy_out(&triangles, number_.data() + vertices_, 1);
  corners_.reserve(std::size_t{3} * triangles);
  executor_->each(vertices_, TakeTriangles{own, number_.data(), corners_.data()});
  return triangles;
}

template <class Executor>
std::vector<ErrorSums> Engine<Executor>::measure(const OwnTriangles& own, std::size_t triangles, double tolerance) {
  errors_.reserve(blocks_.size());
  executor_->zero(errors_.data(), blocks_.size());
  // Few triangles are large: several warps share one.
  const std::size_t length = std::clamp<std::size_t>(triangles / kRunsWanted, 1, 32);
  const std::size_t parts = std::clamp<std::size_t>(kPartsWanted / std::max<std::size_t>(triangles, 1), 1, Executor::kMostParts);
  executor_->each_run((triangles + length - 1) / length * parts,
                      MeasureTriangles{own, corners_.data(), triangles, length, parts, kErrorUnits / tolerance, errors_.data()});
  std::vector<ErrorSums> errors(blocks_.size());
  executor_->copy_out(errors.data(), errors_.data(), errors.size());
  return errors;
}

template <class Executor>
void Engine<Executor>::download(std::size_t triangles, std::span<const ErrorSums> errors, double tolerance,
                                std::vector<BlockMesh>& meshes) {
  std::vector<std::uint32_t> position(vertices_), corners(3 * triangles);
  std::vector<float> height(vertices_);
  std::vector<std::uint8_t> mark(vertices_);
  executor_->copy_out(position.data(), mesh_.position.data(), vertices_);
  executor_->copy_out(height.data(), mesh_.height.data(), vertices_);
  executor_->copy_out(mark.data(), mesh_.mark.data(), vertices_);
  executor_->copy_out(corners.data(), corners_.data(), corners.size());
  std::size_t t = 0;
  for (std::size_t b = 0; b < meshes.size(); ++b) {
    BlockMesh& mesh = meshes[b];
    mesh = {};
    const std::uint32_t first = first_vertex_[b], end = first_vertex_[b + 1];
    for (std::uint32_t v = first; v < end; ++v) {
      const bool is_void = (mark[v] & kVoidVertex) != 0;
      mesh.x.push_back(static_cast<std::uint16_t>(position_x(position[v])));
      mesh.y.push_back(static_cast<std::uint16_t>(position_y(position[v])));
      mesh.height.push_back(is_void ? 0 : static_cast<std::int32_t>(height[v]));
      mesh.is_void.push_back(is_void ? 1 : 0);
    }
    for (; t < triangles && corners[3 * t] < end; ++t)
      mesh.triangles.push_back({corners[3 * t] - first, corners[3 * t + 1] - first, corners[3 * t + 2] - first});
    if (!blocks_[b].field.height) mesh.bound = std::move(bound_);
    mesh.max_error_m = std::bit_cast<double>(errors[b].max_bits) * proto::kHeightStep_m;
    mesh.measured = errors[b].samples;
    if (mesh.measured) {
      mesh.rmse_m = std::sqrt(static_cast<double>(errors[b].squares) / static_cast<double>(mesh.measured)) * tolerance /
                    kErrorUnits * proto::kHeightStep_m;
    }
  }
}

}  // namespace cordillera::gpu::exact
