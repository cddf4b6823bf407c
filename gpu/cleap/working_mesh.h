#pragma once
// The arrays of the mesh in work: loaded, connected, with the gaps closed, taken out.
#include <algorithm>
#include <cmath>
#include <utility>

#include "gpu/cleap/build_steps.h"
#include "gpu/cleap/quadric.h"
#include "gpu/cleap/rearrange.h"
#include "gpu/cleap/refine_steps.h"

namespace cordillera::gpu::cleap {

template <class Device>
class WorkingMesh {
  template <class T>
  using Array = typename Device::template Array<T>;

 public:
  explicit WorkingMesh(Device& device) : device_(device) {}

  const Arrays& arrays() const { return mesh_; }

  void load(const fit::HeightMesh& from) {
    std::vector<Position> position(from.vertices());
    for (std::size_t v = 0; v < position.size(); ++v) position[v] = {from.x[v], from.y[v], from.z[v]};
    mesh_ = {};
    mesh_.origin = position.front();
    mesh_.vertices = static_cast<std::uint32_t>(from.vertices());
    mesh_.triangles = static_cast<std::uint32_t>(from.triangles.size());
    mesh_.vertex = room(vertex_, mesh_.vertices);
    mesh_.corner = room(corner_[0], std::size_t{3} * mesh_.triangles);
    device_.copy_in(mesh_.vertex, position.data(), position.size());
    device_.copy_in(reinterpret_cast<std::uint32_t*>(mesh_.corner), from.triangles.front().data(), 3 * from.triangles.size());
    wait();
  }

  void load_tags(const std::vector<Tag>& tags, double rim_units) {
    mesh_.tag = room(tag_, mesh_.vertices);
    mesh_.inverse_rim = rim_units > 0 ? 1 / rim_units : 1e30;
    device_.copy_in(mesh_.tag, tags.data(), tags.size());
    wait();
  }
  std::vector<Tag> tags() {
    std::vector<Tag> tags(mesh_.vertices);
    device_.copy_out(tags.data(), mesh_.tag, tags.size());
    return tags;
  }

  /// Rows and edges of the triangles as they are (section 4.2); false: an edge has more than two triangles.
  bool connect(bool with_edges_of) {
    std::uint32_t* const count = room(count_, std::max(mesh_.vertices, mesh_.triangles) + 1u);
    std::uint32_t* const number = room(number_, 2);
    device_.zero(count, mesh_.vertices);
    device_.zero(number, 2);
    device_.each_counting(mesh_.triangles, CountTriangles{mesh_.corner, count});
    device_.each(mesh_.vertices, FindLongest{count, number});
    std::uint32_t longest = 0;
    device_.copy_out(&longest, number, 1);
    mesh_.row_places = std::max(kRowPlaces, longest);
    mesh_.table = room(table_, std::size_t{mesh_.vertices} * (mesh_.row_places + 2));
    mesh_.border = room(border_, mesh_.vertices);
    mesh_.flag = room(flag_, mesh_.triangles);
    mesh_.edge_of = with_edges_of ? room(edge_of_, std::size_t{3} * mesh_.triangles) : nullptr;
    device_.each(mesh_.vertices, EmptyRows{mesh_});
    device_.each_counting(mesh_.triangles, FillRows{mesh_});
    device_.each(mesh_.vertices, SortRow{mesh_});
    device_.each(mesh_.vertices, CountEdges{mesh_, count, number + 1});
    return make_edges(count, number);
  }

  /// The quadrics of section 3.2.2, of the mesh as it is; afterwards they are carried along.
  void sum_planes() {
    mesh_.quadric = room(quadric_, mesh_.vertices);
    device_.each(mesh_.vertices, SumPlanes{mesh_});
  }

  /// Section 4.7.1; then triangles without gaps too. Edges are left as they were: connect() makes them anew.
  void rearrange(Rearrange way) {
    const std::uint32_t left = way == Rearrange::scan ? scan() : two_pointers();
    std::uint32_t* const alive = room(count_, std::max(mesh_.vertices, mesh_.triangles) + 1u);
    std::uint32_t* const before = room(before_, std::max(mesh_.vertices, mesh_.triangles) + 1u);
    device_.each(mesh_.triangles, MarkTriangle{mesh_, alive});
    const std::uint32_t triangles = sum_before(alive, before, mesh_.triangles);
    device_.each(mesh_.triangles, MoveTriangle{mesh_, before, room(corner_[1], std::size_t{3} * mesh_.triangles)});
    std::swap(corner_[0], corner_[1]);
    mesh_.corner = corner_[0].data();
    mesh_.triangles = triangles;
    mesh_.vertices = left;
    mesh_.edges = 0;
  }

  /// Flips until nothing gains, of a mesh that is connected; the rows are those of before.
  void make_delaunay() {
    constexpr int kMostRounds = 200;
    std::uint8_t* const wants = room(wants_, mesh_.edges);
    std::int32_t* const partner = room(gap_, std::max(mesh_.vertices, mesh_.triangles));
    std::uint32_t* const flips = room(number_, 2);
    for (int round = 0; round < kMostRounds; ++round) {
      device_.zero(flips, 1);
      device_.each(mesh_.triangles, FreeFlags{mesh_});
      device_.each(mesh_.triangles, ForgetPartner{partner});
      device_.each(mesh_.edges, WantFlip{mesh_, wants});
      device_.each(mesh_.edges, Flip{mesh_, wants, partner, flips});
      device_.each(mesh_.edges, FollowFlip{mesh_, partner});
      std::uint32_t some = 0;
      device_.copy_out(&some, flips, 1);
      if (some == 0) return;
    }
  }

  void smooth(double factor) {
    device_.each(mesh_.vertices, Smooth{mesh_, factor, room(smoothed_, mesh_.vertices)});
    std::swap(vertex_, smoothed_);
    mesh_.vertex = vertex_.data();
  }

  fit::HeightMesh taken_out() {
    std::vector<Position> position(mesh_.vertices);
    fit::HeightMesh mesh;
    mesh.triangles.resize(mesh_.triangles);
    device_.copy_out(position.data(), mesh_.vertex, position.size());
    if (mesh_.triangles > 0) {
      device_.copy_out(mesh.triangles.front().data(), reinterpret_cast<std::uint32_t*>(mesh_.corner),
                       std::size_t{3} * mesh_.triangles);
    }
    for (const Position& p : position) {
      mesh.x.push_back(p.x);
      mesh.y.push_back(p.y);
      mesh.z.push_back(p.z);
    }
    return mesh;
  }

  /// Until all steps are done.
  void wait() {
    std::uint32_t nothing = 0;
    device_.copy_out(&nothing, room(number_, 2), 1);
  }

 private:
  static constexpr std::uint32_t kRowPlaces = 8;  ///< Figure 4.3; more where the input needs more

  std::uint32_t sum_before(const std::uint32_t* values, std::uint32_t* before, std::uint32_t n) {
    if (n == 0) return 0;
    device_.exclusive_sum(values, before, n);
    std::uint32_t sum = 0, last = 0;
    device_.copy_out(&sum, before + (n - 1), 1);
    device_.copy_out(&last, values + (n - 1), 1);
    return sum + last;
  }

  bool make_edges(std::uint32_t* count, const std::uint32_t* number) {
    std::uint32_t crowded = 0;
    device_.copy_out(&crowded, number + 1, 1);
    if (crowded) return false;
    std::uint32_t* const first = room(before_, std::max(mesh_.vertices, mesh_.triangles) + 1u);
    mesh_.edges = sum_before(count, first, mesh_.vertices);
    mesh_.edge = room(edge_, mesh_.edges);
    device_.each(mesh_.vertices, MakeEdges{mesh_, first});
    device_.each(mesh_.edges, NoteEdge{mesh_});
    return true;
  }

  std::uint32_t scan() {
    std::uint32_t* const alive = room(count_, std::max(mesh_.vertices, mesh_.triangles) + 1u);
    std::uint32_t* const before = room(before_, std::max(mesh_.vertices, mesh_.triangles) + 1u);
    device_.each(mesh_.vertices, MarkAlive{mesh_, alive});
    const std::uint32_t left = sum_before(alive, before, mesh_.vertices);
    std::int32_t* const gap = room(gap_, std::max(mesh_.vertices, mesh_.triangles));
    std::int32_t* const number = room(new_number_, mesh_.vertices);
    device_.each(mesh_.vertices, FindGaps{mesh_, before, left, gap});
    device_.each(mesh_.vertices, FillGaps{mesh_, before, left, gap, number});
    device_.each(mesh_.triangles, RenumberTriangle{mesh_, number});
    device_.each(mesh_.edges, RenumberEdge{mesh_, number});
    return left;
  }

  /// Algorithm 18: swaps one after the other on the host, references on the device. Quadrics stay behind, so it is for the last
  /// time only.
  std::uint32_t two_pointers() {
    std::vector<Position> vertex(mesh_.vertices);
    device_.copy_out(vertex.data(), mesh_.vertex, vertex.size());
    const auto is_gap = [&](std::size_t v) { return std::isinf(vertex[v].x); };
    std::size_t red = 0, blue = vertex.size();
    while (true) {
      while (red < blue && !is_gap(red)) ++red;
      while (blue > red && is_gap(blue - 1)) --blue;
      if (red >= blue) break;
      std::swap(vertex[red], vertex[--blue]);
      const auto from = static_cast<std::int32_t>(blue), to = static_cast<std::int32_t>(red);
      device_.each(mesh_.triangles, SwapInTriangle{mesh_, from, to});
      device_.each(mesh_.edges, SwapInEdge{mesh_, from, to});
    }
    device_.copy_in(mesh_.vertex, vertex.data(), vertex.size());
    wait();
    return static_cast<std::uint32_t>(red);
  }

  Device& device_;
  Arrays mesh_;
  Array<Position> vertex_, smoothed_;
  Array<std::int32_t> corner_[2], table_, edge_of_, gap_, new_number_;
  Array<Edge> edge_;
  Array<std::uint8_t> border_, wants_;
  Array<std::uint32_t> flag_, count_, before_, number_;
  Array<PlaneQuadric> quadric_;
  Array<Tag> tag_;
};

}  // namespace cordillera::gpu::cleap
