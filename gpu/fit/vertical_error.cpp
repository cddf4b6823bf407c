#include "gpu/fit/vertical_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace cordillera::gpu {
namespace {

constexpr double kSlack = 1e-6;  // of the extent
constexpr double kPointsPerCell = 4;

struct Point2 {
  double x = 0, y = 0;
};
double cross(Point2 a, Point2 b) { return a.x * b.y - a.y * b.x; }
Point2 operator-(Point2 a, Point2 b) { return {a.x - b.x, a.y - b.y}; }
double length(Point2 a) { return std::sqrt(a.x * a.x + a.y * a.y); }

/// Points sorted into the square cells of a grid over their own extent.
class PointGrid {
 public:
  explicit PointGrid(const PointsXyz& points) : points_(points) {
    const auto [west, east] = std::minmax_element(points.x.begin(), points.x.end());
    const auto [south, north] = std::minmax_element(points.y.begin(), points.y.end());
    low_ = {*west, *south};
    const double wide = *east - *west, high = *north - *south;
    extent_ = std::max(wide, high);
    const double cells = std::max(1.0, static_cast<double>(points.x.size()) / kPointsPerCell);
    // On a line a cell is a piece of it.
    cell_ = std::max(std::sqrt(wide * high / cells), extent_ / cells);
    if (!(cell_ > 0)) cell_ = 1;
    columns_ = static_cast<std::int64_t>(wide / cell_) + 1;
    rows_ = static_cast<std::int64_t>(high / cell_) + 1;
    sort();
  }

  std::int64_t rows() const { return rows_; }
  double slack() const { return kSlack * extent_; }
  double south_of(std::int64_t row) const { return low_.y + static_cast<double>(row) * cell_; }
  std::int64_t row_of(double y) const { return clamped((y - low_.y) / cell_, rows_); }
  std::int64_t column_of(double x) const { return clamped((x - low_.x) / cell_, columns_); }
  /// The points of a row's cells from column first to last.
  std::span<const std::uint32_t> cells(std::int64_t row, std::int64_t first, std::int64_t last) const {
    const std::size_t from = start_[static_cast<std::size_t>(row * columns_ + first)];
    const std::size_t to = start_[static_cast<std::size_t>(row * columns_ + last + 1)];
    return std::span(order_).subspan(from, to - from);
  }

 private:
  static std::int64_t clamped(double cell, std::int64_t count) {
    return static_cast<std::int64_t>(std::clamp(cell, 0.0, static_cast<double>(count - 1)));
  }
  void sort() {
    const auto cell_of = [&](std::size_t p) {
      return static_cast<std::size_t>(row_of(points_.y[p]) * columns_ + column_of(points_.x[p]));
    };
    start_.assign(static_cast<std::size_t>(rows_ * columns_) + 1, 0);
    for (std::size_t p = 0; p < points_.x.size(); ++p) ++start_[cell_of(p) + 1];
    for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
    order_.resize(points_.x.size());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    for (std::size_t p = 0; p < points_.x.size(); ++p) order_[next[cell_of(p)]++] = static_cast<std::uint32_t>(p);
  }

  const PointsXyz& points_;
  Point2 low_;
  double extent_ = 0, cell_ = 1;
  std::int64_t columns_ = 1, rows_ = 1;
  std::vector<std::size_t> start_;  // indexed by cell, one more at the end: where its points begin in order_
  std::vector<std::uint32_t> order_;
};

/// One triangle, turned counter-clockwise.
struct JudgedTriangle {
  std::array<Point2, 3> at;
  std::array<double, 3> z{}, side{};  // side k is opposite of corner k

  JudgedTriangle(const proto::TriangleMesh& mesh, const std::array<std::uint32_t, 3>& corners) {
    for (std::size_t k = 0; k < 3; ++k) {
      at[k] = {mesh.x[corners[k]], mesh.y[corners[k]]};
      z[k] = mesh.z[corners[k]];
    }
    if (cross(at[1] - at[0], at[2] - at[0]) < 0) {
      std::swap(at[1], at[2]);
      std::swap(z[1], z[2]);
    }
    for (std::size_t k = 0; k < 3; ++k) side[k] = length(at[(k + 2) % 3] - at[(k + 1) % 3]);
  }

  /// Twice the areas of p with each side; that of side k counts for corner k. Two triangles at one side find areas of exactly
  /// opposite sign there, so that no point falls between them.
  std::array<double, 3> areas(Point2 p) const {
    const Point2 a = at[0] - p, b = at[1] - p, c = at[2] - p;
    return {cross(b, c), cross(c, a), cross(a, b)};
  }
  /// How far p is outside, at most; 0 inside.
  double outside(const std::array<double, 3>& areas) const {
    double farthest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (areas[k] < 0) farthest = std::max(farthest, -areas[k] / side[k]);
    }
    return farthest;
  }
  /// The height at a point of these areas; negative ones count as none.
  double height(std::array<double, 3> areas) const {
    for (double& area : areas) area = std::max(area, 0.0);
    const double sum = areas[0] + areas[1] + areas[2];
    if (!(sum > 0)) return std::numeric_limits<double>::quiet_NaN();
    return (areas[0] * z[0] + areas[1] * z[1] + areas[2] * z[2]) / sum;
  }

  /// Where the triangle lies between two heights of the plan, in x; an empty stretch if it does not come there.
  std::array<double, 2> stretch(double south, double north) const {
    double west = std::numeric_limits<double>::infinity(), east = -west;
    const auto take = [&](double x) {
      west = std::min(west, x);
      east = std::max(east, x);
    };
    for (std::size_t k = 0; k < 3; ++k) {
      const Point2 a = at[k], b = at[(k + 1) % 3];
      if (a.y >= south && a.y <= north) take(a.x);
      for (const double y : {south, north}) {
        if ((a.y < y) != (b.y < y)) take(a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)));
      }
    }
    return {west, east};
  }
};

/// What is known of each point so far.
struct Found {
  std::vector<double> error, outside;  // indexed by point; outside: of the triangle that the error is from, 0 inside
};

/// Errors of the points in some rows of cells. No point is in two of them, so rows can be shared among threads.
class RowMeter {
 public:
  RowMeter(const proto::TriangleMesh& surface, const PointsXyz& points, const PointGrid& grid, Found& found)
      : surface_(surface), points_(points), grid_(grid), found_(found) {}

  void measure(std::int64_t first, std::int64_t last) const {
    for (const auto& corners : surface_.triangles) {
      const JudgedTriangle facet(surface_, corners);
      const double south = std::min({facet.at[0].y, facet.at[1].y, facet.at[2].y}) - grid_.slack();
      const double north = std::max({facet.at[0].y, facet.at[1].y, facet.at[2].y}) + grid_.slack();
      const std::int64_t from = std::max(first, grid_.row_of(south)), to = std::min(last, grid_.row_of(north));
      for (std::int64_t row = from; row <= to; ++row) measure(facet, row);
    }
  }

 private:
  void measure(const JudgedTriangle& facet, std::int64_t row) const {
    const double slack = 2 * grid_.slack();  // the cells' own bounds are rounded
    const auto [west, east] = facet.stretch(grid_.south_of(row) - slack, grid_.south_of(row + 1) + slack);
    if (west > east) return;
    for (const std::uint32_t p : grid_.cells(row, grid_.column_of(west - slack), grid_.column_of(east + slack))) {
      measure(facet, p);
    }
  }
  void measure(const JudgedTriangle& facet, std::uint32_t p) const {
    const std::array<double, 3> areas = facet.areas({points_.x[p], points_.y[p]});
    const double outside = facet.outside(areas);
    if (!(outside <= grid_.slack()) || outside > found_.outside[p]) return;
    const double away = std::abs(facet.height(areas) - points_.z[p]);
    // A triangle without area says nothing; its neighbours have the point.
    if (std::isnan(away)) return;
    found_.error[p] = outside < found_.outside[p] ? away : std::max(found_.error[p], away);
    found_.outside[p] = outside;
  }

  const proto::TriangleMesh& surface_;
  const PointsXyz& points_;
  const PointGrid& grid_;
  Found& found_;
};

VerticalError summed(const Found& found) {
  VerticalError total;
  double squares = 0;
  for (std::size_t p = 0; p < found.error.size(); ++p) {
    if (std::isinf(found.outside[p])) {
      ++total.uncovered;
      continue;
    }
    ++total.measured;
    squares += found.error[p] * found.error[p];
    if (found.error[p] <= total.max) continue;
    total.max = found.error[p];
    total.worst = p;
  }
  if (total.measured > 0) total.rmse = std::sqrt(squares / static_cast<double>(total.measured));
  return total;
}

}  // namespace

VerticalError vertical_error(const proto::TriangleMesh& surface, const PointsXyz& points, std::size_t shares,
                             const ParallelFor& parallel) {
  if (points.x.empty()) return {};
  const PointGrid grid(points);
  Found found{std::vector<double>(points.x.size(), 0),
              std::vector<double>(points.x.size(), std::numeric_limits<double>::infinity())};
  const RowMeter meter(surface, points, grid, found);
  const std::int64_t rows = grid.rows(), count = std::clamp<std::int64_t>(static_cast<std::int64_t>(shares), 1, rows);
  parallel(static_cast<std::size_t>(count), [&](std::size_t share) {
    const auto k = static_cast<std::int64_t>(share);
    meter.measure(rows * k / count, rows * (k + 1) / count - 1);
  });
  return summed(found);
}

}  // namespace cordillera::gpu
