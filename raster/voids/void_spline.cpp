#include "raster/voids/void_spline.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

namespace cordillera::raster {
namespace {

/// What stretching weighs against bending, for cells of a unit's height. tests/bench/voids compares: less is better in mountains
/// and for small voids, more on flat land and for wide ones.
constexpr double kTension = 0.01;
/// Of each grid. What they leave is smooth, and left by intention: the last bend of a wide void is noise of its rim, told farther
/// in.
constexpr int kMostSteps = 60;
constexpr double kClose_m = 1e-4;  // half of what heights are rounded to, and less
constexpr int kPad = 2;            // cells that a second difference reaches
constexpr std::size_t kFew = 12;   // wanted cells that need no coarser grid

/// One grid of the pyramid. Cells have a frame of kPad outside cells, so that no neighbour is beyond the arrays.
struct Level {
  int columns = 0, rows = 0;  ///< frame included
  double x2 = 1;              ///< square of height over width of a cell
  double tension = 0;         ///< against bending, in units of a cell's height
  std::vector<std::uint8_t> cell;
  std::vector<double> height_m;
  std::vector<std::uint32_t> wanted;  ///< places of wanted cells, ascending

  Level(int wide, int high)
      : columns(wide + 2 * kPad),
        rows(high + 2 * kPad),
        cell(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), VoidGrid::outside),
        height_m(cell.size(), 0) {}
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y + kPad) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x + kPad);
  }
  int inner_columns() const { return columns - 2 * kPad; }
  int inner_rows() const { return rows - 2 * kPad; }

  void list_wanted() {
    for (std::size_t k = 0; k < cell.size(); ++k)
      if (cell[k] == VoidGrid::wanted) wanted.push_back(static_cast<std::uint32_t>(k));
  }
};

/// The energy's derivative by one height, and its second derivative, where some neighbour is outside: difference by difference.
class Differences {
 public:
  explicit Differences(const Level& level) : level_(level), down_(level.columns), xx_(level.x2 * level.x2), xy_(2 * level.x2) {}

  double derivative(const double* z, std::ptrdiff_t k) const {
    double sum = 0;
    each(k, [&](double weight, double own, Parts parts) {
      double difference = 0;
      for (const auto& [place, factor] : parts) difference += factor * z[place];
      sum += weight * own * difference;
    });
    return sum;
  }
  double diagonal(std::ptrdiff_t k) const {
    double sum = 0;
    each(k, [&](double weight, double own, Parts) { sum += weight * own * own; });
    return sum;
  }

 private:
  using Parts = std::initializer_list<std::pair<std::ptrdiff_t, double>>;  ///< places and factors of a difference
  bool is(std::ptrdiff_t k) const { return level_.cell[static_cast<std::size_t>(k)] != VoidGrid::outside; }

  template <typename Visit>
  void each(std::ptrdiff_t k, const Visit& visit) const {
    along(k, 1, xx_, level_.tension * level_.x2, visit);
    along(k, down_, 1, level_.tension, visit);
    for (const std::ptrdiff_t corner : {k, k - 1, k - down_, k - down_ - 1}) {
      const std::ptrdiff_t right = corner + 1, below = corner + down_, across = corner + down_ + 1;
      if (!is(corner) || !is(right) || !is(below) || !is(across)) continue;
      visit(xy_, k == corner || k == across ? 1.0 : -1.0, {{corner, 1.0}, {right, -1.0}, {below, -1.0}, {across, 1.0}});
    }
  }
  template <typename Visit>
  void along(std::ptrdiff_t k, std::ptrdiff_t step, double bending, double stretching, const Visit& visit) const {
    for (std::ptrdiff_t middle = k - step; middle <= k + step; middle += step) {
      if (!is(middle - step) || !is(middle) || !is(middle + step)) continue;
      visit(bending, middle == k ? -2.0 : 1.0, {{middle - step, 1.0}, {middle, -2.0}, {middle + step, 1.0}});
    }
    if (is(k - step)) visit(stretching, 1.0, {{k, 1.0}, {k - step, -1.0}});
    if (is(k + step)) visit(stretching, 1.0, {{k, 1.0}, {k + step, -1.0}});
  }

  const Level& level_;
  std::ptrdiff_t down_;
  double xx_, xy_;
};

/// The energy's derivative at all wanted cells: closed where no neighbour is outside.
class Bending {
 public:
  explicit Bending(const Level& level) : level_(level), differences_(level), down_(level.columns) {
    const double x2 = level.x2, x4 = x2 * x2, t = level.tension;
    centre_ = 6 + 8 * x2 + 6 * x4 + 2 * t * (1 + x2);
    side_ = -4 * x4 - 4 * x2 - t * x2;
    end_ = -4 - 4 * x2 - t;
    corner_ = 2 * x2;
    far_ = x4;
    whole_.reserve(level.wanted.size());
    for (const std::uint32_t k : level.wanted) whole_.push_back(surrounded(k) ? 1 : 0);
  }

  /// Gives the sum of their products with z.
  double derivative(const std::vector<double>& z, std::vector<double>& out) const {
    double sum = 0;
    for (std::size_t w = 0; w < out.size(); ++w) {
      const double* const p = z.data() + level_.wanted[w];
      out[w] = whole_[w] == 0 ? differences_.derivative(z.data(), level_.wanted[w])
                              : centre_ * p[0] + side_ * (p[-1] + p[1]) + end_ * (p[-down_] + p[down_]) +
                                    corner_ * ((p[-down_ - 1] + p[-down_ + 1]) + (p[down_ - 1] + p[down_ + 1])) +
                                    far_ * (p[-2] + p[2]) + (p[-2 * down_] + p[2 * down_]);
      sum += p[0] * out[w];
    }
    return sum;
  }
  double diagonal(std::size_t w) const { return whole_[w] != 0 ? centre_ : differences_.diagonal(level_.wanted[w]); }

 private:
  bool surrounded(std::uint32_t k) const {
    const std::uint8_t* const c = level_.cell.data() + k;
    for (const std::ptrdiff_t to : {std::ptrdiff_t{-2}, std::ptrdiff_t{-1}, std::ptrdiff_t{1}, std::ptrdiff_t{2}, -2 * down_,
                                    -down_ - 1, -down_, -down_ + 1, down_ - 1, down_, down_ + 1, 2 * down_}) {
      if (c[to] == VoidGrid::outside) return false;
    }
    return true;
  }

  const Level& level_;
  Differences differences_;
  std::ptrdiff_t down_;
  double centre_, side_, end_, corner_, far_;
  std::vector<std::uint8_t> whole_;  ///< indexed by wanted cell: no neighbour is outside
};

/// Conjugate gradients from the heights that are there.
void relax(Level& level, int most_steps) {
  const std::size_t count = level.wanted.size();
  const Bending bending(level);
  std::vector<double> residual(count), product(count), scale(count);
  bending.derivative(level.height_m, residual);
  std::vector<double> direction(level.cell.size(), 0);
  double strength = 0, greatest_m = 0;
  for (std::size_t w = 0; w < count; ++w) {
    scale[w] = 1 / bending.diagonal(w);
    residual[w] = -residual[w];
    direction[level.wanted[w]] = scale[w] * residual[w];
    strength += residual[w] * scale[w] * residual[w];
    greatest_m = std::max(greatest_m, std::abs(scale[w] * residual[w]));
  }
  for (int step = 0; step < most_steps && greatest_m >= kClose_m; ++step) {
    const double curvature = bending.derivative(direction, product);
    if (!(curvature > 0)) return;
    const double length = strength / curvature;
    double next = 0;
    greatest_m = 0;
    for (std::size_t w = 0; w < count; ++w) {
      level.height_m[level.wanted[w]] += length * direction[level.wanted[w]];
      residual[w] -= length * product[w];
      next += residual[w] * scale[w] * residual[w];
      greatest_m = std::max(greatest_m, std::abs(scale[w] * residual[w]));
    }
    const double turn = next / strength;
    strength = next;
    for (std::size_t w = 0; w < count; ++w)
      direction[level.wanted[w]] = scale[w] * residual[w] + turn * direction[level.wanted[w]];
  }
}

/// Cells of a finer grid that one of a coarser grid stands for.
struct Merge {
  int across = 2, down = 2;
};
Merge merge_of(const Level& fine) { return {fine.x2 > 0.4 ? 2 : 1, fine.x2 < 2.5 ? 2 : 1}; }

/// Known where anything is; the mean of it.
Level coarser(const Level& fine, const Merge& merge) {
  Level coarse((fine.inner_columns() + merge.across - 1) / merge.across, (fine.inner_rows() + merge.down - 1) / merge.down);
  coarse.x2 = fine.x2 * merge.down * merge.down / (merge.across * merge.across);
  coarse.tension = fine.tension * merge.down * merge.down;
  for (int y = 0; y < coarse.inner_rows(); ++y) {
    for (int x = 0; x < coarse.inner_columns(); ++x) {
      double sum = 0;
      int known = 0, wanted = 0;
      for (int fy = merge.down * y; fy < std::min(merge.down * (y + 1), fine.inner_rows()); ++fy) {
        for (int fx = merge.across * x; fx < std::min(merge.across * (x + 1), fine.inner_columns()); ++fx) {
          const std::size_t k = fine.at(fx, fy);
          wanted += fine.cell[k] == VoidGrid::wanted ? 1 : 0;
          if (fine.cell[k] != VoidGrid::known) continue;
          sum += fine.height_m[k];
          ++known;
        }
      }
      const std::size_t k = coarse.at(x, y);
      if (known > 0) coarse.height_m[k] = sum / known;
      coarse.cell[k] = known > 0 ? VoidGrid::known : wanted > 0 ? VoidGrid::wanted : VoidGrid::outside;
    }
  }
  coarse.list_wanted();
  return coarse;
}

/// A cell's own coarser cell and the one on its nearer side, with their weights.
struct Blend {
  int own = 0, beside = 0;
  double share = 0;  ///< of beside
};
Blend blend_of(int fine, int merge) {
  if (merge == 1) return {fine, fine, 0};
  return {fine / 2, fine / 2 + (fine % 2 == 0 ? -1 : 1), 0.25};
}

/// Heights of the wanted cells from a coarser grid, bilinear.
void take_from(const Level& coarse, const Merge& merge, Level& fine) {
  for (int y = 0; y < fine.inner_rows(); ++y) {
    for (int x = 0; x < fine.inner_columns(); ++x) {
      const std::size_t k = fine.at(x, y);
      if (fine.cell[k] != VoidGrid::wanted) continue;
      const Blend across = blend_of(x, merge.across), down = blend_of(y, merge.down);
      double sum = 0, weights = 0;
      const auto add = [&](int cx, int cy, double weight) {
        const std::size_t c = coarse.at(cx, cy);
        if (weight == 0 || coarse.cell[c] == VoidGrid::outside) return;
        sum += weight * coarse.height_m[c];
        weights += weight;
      };
      add(across.own, down.own, (1 - across.share) * (1 - down.share));
      add(across.beside, down.own, across.share * (1 - down.share));
      add(across.own, down.beside, (1 - across.share) * down.share);
      add(across.beside, down.beside, across.share * down.share);
      fine.height_m[k] = sum / weights;  // its own cell is never outside
    }
  }
}

void start_from_mean(Level& level) {
  double sum = 0;
  std::size_t known = 0;
  for (std::size_t k = 0; k < level.cell.size(); ++k) {
    if (level.cell[k] != VoidGrid::known) continue;
    sum += level.height_m[k];
    ++known;
  }
  for (const std::uint32_t k : level.wanted) level.height_m[k] = known > 0 ? sum / static_cast<double>(known) : 0;
}

/// From the coarsest grid to this one.
void solve(Level& level) {
  if (level.wanted.empty()) return;
  if (level.wanted.size() <= kFew) {
    start_from_mean(level);
  } else {
    const Merge merge = merge_of(level);
    Level coarse = coarser(level, merge);
    solve(coarse);
    take_from(coarse, merge, level);
  }
  relax(level, kMostSteps);
}

/// What rises evenly is no bend: taken off before and put on again, so that no step is spent on it. Through the known cells, by
/// least squares.
class Slope {
 public:
  explicit Slope(const VoidGrid& grid) {
    double count = 0, sum_x = 0, sum_y = 0, sum_z = 0;
    each_known(grid, [&](double x, double y, double z) { count += 1, sum_x += x, sum_y += y, sum_z += z; });
    if (count == 0) return;
    x_ = sum_x / count, y_ = sum_y / count, z_ = sum_z / count;
    double xx = 0, xy = 0, yy = 0, xz = 0, yz = 0;
    each_known(grid, [&](double x, double y, double z) {
      xx += (x - x_) * (x - x_), xy += (x - x_) * (y - y_), yy += (y - y_) * (y - y_);
      xz += (x - x_) * (z - z_), yz += (y - y_) * (z - z_);
    });
    const double area = xx * yy - xy * xy;
    if (!(area > 0)) return;
    by_x_ = (xz * yy - yz * xy) / area;
    by_y_ = (yz * xx - xz * xy) / area;
  }
  double height_m(int x, int y) const { return z_ + by_x_ * (x - x_) + by_y_ * (y - y_); }

 private:
  template <typename Visit>
  static void each_known(const VoidGrid& grid, const Visit& visit) {
    for (int y = 0; y < grid.rows; ++y)
      for (int x = 0; x < grid.columns; ++x)
        if (grid.cell[grid.at(x, y)] == VoidGrid::known) visit(x, y, grid.height_m[grid.at(x, y)]);
  }
  double x_ = 0, y_ = 0, z_ = 0, by_x_ = 0, by_y_ = 0;
};

}  // namespace

void fill_spline(VoidGrid& grid) {
  const Slope slope(grid);
  Level level(grid.columns, grid.rows);
  level.x2 = grid.stretch * grid.stretch;
  level.tension = kTension;
  for (int y = 0; y < grid.rows; ++y) {
    for (int x = 0; x < grid.columns; ++x) {
      level.cell[level.at(x, y)] = grid.cell[grid.at(x, y)];
      level.height_m[level.at(x, y)] = grid.height_m[grid.at(x, y)] - slope.height_m(x, y);
    }
  }
  level.list_wanted();
  solve(level);
  for (int y = 0; y < grid.rows; ++y)
    for (int x = 0; x < grid.columns; ++x)
      if (grid.cell[grid.at(x, y)] == VoidGrid::wanted)
        grid.height_m[grid.at(x, y)] = level.height_m[level.at(x, y)] + slope.height_m(x, y);
}

}  // namespace cordillera::raster
