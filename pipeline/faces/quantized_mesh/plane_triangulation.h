#pragma once
// A triangulation of a square of integers that keeps the edges it is given: Delaunay's, but beside lines that cross its edges.
#include <array>
#include <cstdint>
#include <vector>

#include "pipeline/encode/published_mesh.h"

namespace cordillera::pipeline::faces {

/// Predicates are exact, so every triangle is counter-clockwise and has an area, whatever is added. Points first, then edges.
class PlaneTriangulation {
 public:
  struct Point {
    std::int32_t x = 0, y = 0;
    friend auto operator<=>(const Point&, const Point&) = default;
  };

  /// size: 1 .. 2^20. Vertices 0 to 3 are the corners, from (0, 0) counter-clockwise.
  explicit PlaneTriangulation(std::int32_t size);

  /// The vertex at a point of the square; a new one where there is none. Near the one before is quick.
  std::uint32_t add(Point point);

  /// Makes the straight line between two vertices edges of the triangulation, split where it meets vertices. A piece that an
  /// earlier line crosses is left out.
  void connect(std::uint32_t from, std::uint32_t to);

  std::size_t vertices() const { return points_.size(); }
  Point point(std::uint32_t vertex) const { return points_[vertex]; }

  static constexpr std::uint32_t kNone = UINT32_MAX;
  struct Face {
    Triangle vertex{};  ///< counter-clockwise
    std::array<std::uint32_t, 3> beside{kNone, kNone,
                                        kNone};  ///< the triangle across the edge from vertex k to the next; kNone: none
    std::array<bool, 3> fixed{};                 ///< edge k is a piece of a line
  };
  /// Neighbours mostly follow each other.
  std::vector<Face> faces() const;

 private:
  struct Half {
    std::uint32_t face = kNone;
    std::uint32_t edge = 0;
  };
  enum class Met : std::uint8_t { vertex, crossing, wall };
  struct Step {
    Met met = Met::wall;
    std::uint32_t vertex = 0;  // where the piece ends
    std::vector<std::array<std::uint32_t, 2>> crossed;
  };

  std::int64_t turn(std::uint32_t a, std::uint32_t b, Point p) const;
  std::int64_t turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const { return turn(a, b, points_[c]); }
  bool in_circle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const;
  Half twin(Half half) const;
  std::uint32_t locate(Point p) const;
  void link(std::uint32_t face, std::uint32_t edge, std::uint32_t other);
  std::uint32_t split_face(std::uint32_t face, Point p);
  std::uint32_t split_edge(Half half, Point p);
  void flip(Half half);
  void legalize(std::vector<Half> doubtful);
  Half find_edge(std::uint32_t a, std::uint32_t b) const;
  template <class Visit>
  void around(std::uint32_t vertex, const Visit& visit) const;
  Step look(std::uint32_t from, std::uint32_t to) const;
  void march(Half crossing, std::uint32_t from, std::uint32_t to, Step* step) const;
  void clear_way(std::uint32_t from, std::uint32_t to, std::vector<std::array<std::uint32_t, 2>> crossed);
  void fix(std::uint32_t a, std::uint32_t b);

  std::vector<Point> points_;
  std::vector<std::uint32_t> face_at_;  // indexed by vertex: one of its faces
  std::vector<Face> faces_;
  mutable std::uint32_t last_ = 0;  // where the search begins
};

}  // namespace cordillera::pipeline::faces
