// What gpu/exact leaves out, or looks at eight at a time, changes nothing: held against plain loops over samples.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "gpu/exact/steps/bounds.h"
#include "gpu/exact/steps/host_team.h"
#include "gpu/exact/steps/start.h"
#include "tests/gpu/exact_terrain.h"

namespace cordillera::gpu::exact {
namespace {

/// A block's samples as the engine has them.
class MadeField {
 public:
  MadeField(const std::string& terrain, const Window& window, double scale = 1) {
    const proto::Samples samples = made_samples(terrain, window);
    field.columns = window.columns, field.rows = window.rows, field.stride = (window.columns + 7) / 8 * 8;
    heights_.resize(static_cast<std::size_t>(field.stride * field.rows) + kReadBeyond);
    depths_.resize(heights_.size());
    std::vector<std::int32_t> from = samples.height;
    for (std::int32_t& height : from) height = height == proto::kNoHeight ? height : static_cast<std::int32_t>(height * scale);
    std::uint32_t voids = 0;
    const LoadSample load{from.data(), window.columns, heights_.data(), depths_.data(),
                          &voids,      field.columns,  field.rows,      field.stride};
    for (int y = 0; y < field.rows; ++y) {
      for (int x = 0; x < field.stride; ++x) load(x, y);
    }
    field.height = heights_.data();
    if (voids) field.depth = depths_.data();
    bound();
  }
  /// The field as it is above blocks.
  Field coded() {
    code_.resize(64 * planes_[0].size());
    for (std::size_t i = 0; i < planes_[0].size(); ++i) CodeSamples{field, code_.data()}(i);
    Field above = field;
    above.height = nullptr, above.depth = nullptr, above.code = code_.data();
    return above;
  }
  void find_depths(int rim_reach) {
    const std::size_t words = heights_.size() / 8;
    std::vector<std::uint64_t> near(words), in_row(words);
    const int across = field.stride / 8;
    const auto spread = [&](bool upright, int reach, const std::uint64_t* from, std::uint64_t* to) {
      for (int y = 0; y < field.rows; ++y) {
        for (int x = 0; x < across; ++x) NearInRow{field, reach, upright, from, to}(x, y);
      }
    };
    for (std::size_t i = 0; i < 8 * words; ++i) MarkKinds{depths_.data(), reinterpret_cast<std::uint8_t*>(near.data())}(i);
    for (int r = 0; r <= rim_reach; ++r) {
      const int reach = r == 0 ? 1 : 1 << (r - 1);
      spread(false, reach, near.data(), in_row.data());
      spread(true, reach, in_row.data(), near.data());
      for (std::size_t i = 0; i < words; ++i) LowerDepth{near.data(), r, depths_.data()}(i);
    }
  }
  Depth depth(int x, int y) const { return depths_[field.index(x, y)]; }

  Field field;

 private:
  /// Of the two tiers that right triangles are asked of.
  void bound() {
    for (int tier = 0; tier < 2; ++tier) {
      field.tier_stride[tier] = ((field.columns - 1) >> tier_shift(tier)) + 1;
      const std::size_t squares = field.squares(tier);
      planes_[tier].resize(squares), tier_depths_[tier].resize(squares);
      field.plane[tier] = planes_[tier].data(), field.tier_depth[tier] = field.depth ? tier_depths_[tier].data() : nullptr;
      for (std::size_t i = 0; i < squares; ++i) {
        if (tier == 0)
          BoundSamples{field, planes_[tier].data(), tier_depths_[tier].data()}(i);
        else
          BoundSquares{field, tier, planes_[tier].data(), tier_depths_[tier].data()}(i);
      }
    }
  }

  std::vector<BoundingPlane> planes_[2];
  std::vector<Depth> tier_depths_[2];
  std::vector<float> heights_;
  std::vector<Depth> depths_;
  std::vector<std::uint8_t> code_;
};

class ExactDepths : public testing::TestWithParam<std::string> {};
TEST_P(ExactDepths, AreThoseOfEverySampleLookedAt) {
  constexpr int kReach = 5;
  MadeField made(GetParam(), {0, 0, 107, 93});
  const Field& field = made.field;
  ASSERT_NE(field.depth, nullptr);
  made.find_depths(kReach);
  for (int y = 0; y < field.rows; ++y) {
    for (int x = 0; x < field.columns; ++x) {
      const bool here = is_void(made.depth(x, y));
      int least_r = kFarthest;
      for (int r = kReach; r >= 0; --r) {
        bool other = false;
        for (int v = std::max(y - (1 << r), 0); v <= std::min(y + (1 << r), field.rows - 1); ++v) {
          for (int u = std::max(x - (1 << r), 0); u <= std::min(x + (1 << r), field.columns - 1); ++u)
            other = other || is_void(made.depth(u, v)) != here;
        }
        if (other) least_r = r;
      }
      ASSERT_EQ(made.depth(x, y), here ? void_depth(least_r) : valid_depth(least_r)) << x << " " << y;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Made, ExactDepths, testing::Values("islands", "sparse"), [](const auto& test) { return test.param; });

/// All right triangles of a square of the start.
template <class F>
void each_right_triangle(int x, int y, int side, const F& f) {
  const GridPlace corner[4] = {{x, y}, {x + side, y}, {x + side, y + side}, {x, y + side}};
  const GridPlace centre{x + side / 2, y + side / 2};
  for (int k = 0; k < 4; ++k) {
    f(corner[k], corner[(k + 1) % 4], corner[(k + 2) % 4]);
    if (side > 1) f(corner[k], corner[(k + 1) % 4], centre);
  }
}

struct CalmCase {
  const char* terrain;
  double scale, tolerance_m;
  float bend, sway;
};
void PrintTo(const CalmCase& c, std::ostream* out) { *out << c.terrain << " times " << c.scale; }

/// The network of a case, over 129 columns.
class CalmNetwork {
 public:
  CalmNetwork(const CalmCase& c, int rows)
      : made_(c.terrain, {0, 0, 129, rows}, c.scale), tolerance_m_(c.tolerance_m), curve_(129, {c.bend, c.sway}), up_(c.bend) {
    net.field = made_.field;
    net.height_step = 64, net.per_height_step = 1.0f / 64;
    ask(1);
  }
  /// So many times the case's tolerance.
  void ask(int times) { net.demand = {static_cast<float>(tolerance_m_ * 1024 * times), -1, {curve_.data(), up_}}; }
  bool fits(const GridPlace& a, const GridPlace& b, const GridPlace& c) const {
    return right_triangle_fits(make_triangle(net.corner(a.x, a.y), net.corner(b.x, b.y), net.corner(c.x, c.y), net.demand),
                               net.field);
  }

  Network net;

 private:
  const MadeField made_;
  const double tolerance_m_;
  const std::vector<CurveRow> curve_;
  const float up_;
};

class ExactCalm : public testing::TestWithParam<CalmCase> {};
TEST_P(ExactCalm, AllTrianglesOfACalmSquareFit) {
  const CalmNetwork made(GetParam(), 129);
  const Network& net = made.net;
  const int across = calm_squares(net.field.columns);
  std::vector<std::uint8_t> calm(static_cast<std::size_t>(across * calm_squares(net.field.rows)));
  std::size_t calm_ones = 0;
  for (int sy = 0; sy < calm_squares(net.field.rows); ++sy) {
    for (int sx = 0; sx < across; ++sx) {
      CalmSquares{net, calm.data()}(sx, sy);
      if (calm[static_cast<std::size_t>(sy * across + sx)] == 0) continue;
      ++calm_ones;
      for (int side = 1; side <= kCalmCells; side *= 2) {
        for (int k = 0; k < kCalmCells / side * (kCalmCells / side); ++k) {
          const int x = kCalmCells * sx + k % (kCalmCells / side) * side, y = kCalmCells * sy + k / (kCalmCells / side) * side;
          each_right_triangle(x, y, side, [&](const GridPlace& a, const GridPlace& b, const GridPlace& d) {
            EXPECT_TRUE(made.fits(a, b, d)) << x << " " << y << " side " << side;
          });
        }
      }
    }
  }
  EXPECT_GT(calm_ones, 20u);
  EXPECT_LT(calm_ones, calm.size());
}
TEST_P(ExactCalm, AllTrianglesOfACalmAreaFit) {
  CalmNetwork made(GetParam(), 125);
  const Network& net = made.net;
  std::size_t calm_ones = 0, others = 0;
  for (int k = 0; k < 12; ++k) {
    made.ask(1 << k);
    for (int shift = 3; shift <= 5; ++shift) {
      const int across = calm_squares(net.field.columns, shift), cells = 1 << shift;
      std::vector<std::uint8_t> calm(static_cast<std::size_t>(across * calm_squares(net.field.rows, shift)));
      for (int n = 0; n < static_cast<int>(calm.size()); ++n) {
        const int x = n % across * cells, y = n / across * cells;
        CalmAreas{net, shift, calm.data()}(n % across, n / across);
        ++(calm[static_cast<std::size_t>(n)] ? calm_ones : others);
        if (!calm[static_cast<std::size_t>(n)] || y + cells >= net.field.rows) continue;
        each_right_triangle(x, y, cells, [&](const GridPlace& a, const GridPlace& b, const GridPlace& d) {
          EXPECT_TRUE(made.fits(a, b, d)) << x << " " << y << " cells " << cells;
        });
      }
    }
  }
  EXPECT_GT(calm_ones, 20u);
  EXPECT_GT(others, 20u);
}
INSTANTIATE_TEST_SUITE_P(Made, ExactCalm,
                         testing::Values(CalmCase{"alpine", 1, 3, 0, 0}, CalmCase{"alpine", 1, 2, 20, 1e-4f},
                                         CalmCase{"cliff", 1, 2, 0, 0}, CalmCase{"islands", 1, 1.5, 1, 0},
                                         CalmCase{"rolling", 1, 0.3, 3, 0}),
                         [](const auto& test) { return std::string(test.param.terrain) + std::to_string(test.index); });

/// Triangles of any shape whose corners are samples.
class AnyTriangles {
 public:
  explicit AnyTriangles(const Field& field) : field_(field) {}
  int any(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  Triangle next(int widest, float tolerance) {
    for (;;) {
      Corner corner[3];
      const int west = any(field_.columns), south = any(field_.rows), wide = 2 + any(widest);
      for (Corner& c : corner) {
        c.x = std::min(west + any(wide), field_.columns - 1), c.y = std::min(south + any(wide), field_.rows - 1);
        c.height = field_.height[field_.index(c.x, c.y)], c.is_void = false;
      }
      const int twice_area =
          (corner[1].x - corner[0].x) * (corner[2].y - corner[0].y) - (corner[1].y - corner[0].y) * (corner[2].x - corner[0].x);
      if (twice_area == 0) continue;
      if (twice_area < 0) std::swap(corner[1], corner[2]);
      return make_triangle(corner[0], corner[1], corner[2], {tolerance, -1, {rows_.data(), 2}});
    }
  }

 private:
  const Field& field_;
  std::mt19937 random_{17};
  const std::vector<CurveRow> rows_ = std::vector<CurveRow>(static_cast<std::size_t>(field_.rows), CurveRow{3, 0});
};

// Tolerances around what they need.
TEST(ExactEightColumns, SayWhatEverySampleSays) {
  const MadeField made("alpine", {640, -320, 61, 50});
  const Field& field = made.field;
  AnyTriangles triangles(field);
  int fitting = 0, others = 0;
  for (int k = 0; k < 20000; ++k) {
    const Triangle t = triangles.next(20, static_cast<float>(1 << triangles.any(16)));
    bool slowly = true, at_once = true;
    for (int y = t.south; y <= t.north; ++y) {
      for (int x = t.west; x <= t.east; ++x) slowly = slowly && sample_fits(t, field, x, y);
    }
    for (int x = t.west; x <= t.east; x += 8) at_once = at_once && eight_columns_fit(t, field, x, t.south, t.north);
    ASSERT_EQ(at_once, slowly) << k;
    ++(slowly ? fitting : others);
  }
  EXPECT_GT(fitting, 2000);
  EXPECT_GT(others, 2000);
}

/// One lane that looks at a sample at a time.
struct OneLane {
  int row() const { return 0; }
  int rows() const { return 1; }
  int column() const { return 0; }
  int columns() const { return 1; }
  float max(float value) const { return value; }
};

class ExactCodedSquares : public testing::TestWithParam<std::string> {};
TEST_P(ExactCodedSquares, SayWhatEverySampleSays) {
  MadeField made(GetParam(), {640, -320, 61, 50});
  const Field above = made.coded();
  AnyTriangles triangles(made.field);
  int fitting = 0, others = 0, none = 0, some = 0;
  for (int k = 0; k < 20000; ++k) {
    const Triangle t = triangles.next(20, static_cast<float>(1 << triangles.any(16)));
    const SquareRange range = squares_under(t, 0);
    const int sx = range.west + triangles.any(range.east - range.west + 1),
              sy = range.south + triangles.any(range.north - range.south + 1);
    const float slowly = coded_square_error(t, above, sx, sy, OneLane{});
    ASSERT_EQ(eight_coded_error(t, above, sx, sy), slowly) << k;
    ++(slowly < 0 ? none : some);
    if (has_void(above, {sx, sx, sy, sy})) continue;
    const bool fits = coded_samples_fit(t, above, sx, sy);
    ASSERT_EQ(eight_coded_fit(t, above, sx, sy), fits) << k;
    ++(fits ? fitting : others);
  }
  EXPECT_GT(fitting, 2000);
  EXPECT_GT(others, 1000);
  EXPECT_GT(none, 200);
  EXPECT_GT(some, 2000);
}
INSTANTIATE_TEST_SUITE_P(Made, ExactCodedSquares, testing::Values("alpine", "islands"),
                         [](const auto& test) { return test.param; });

// Strides of 1 and more; and units beyond those that are rounded the short way.
TEST(ExactEightColumns, PullAsEverySampleDoes) {
  const MadeField made("alpine", {640, -320, 61, 50});
  const Field& field = made.field;
  AnyTriangles triangles(field);
  int strides[5] = {}, many_units = 0;
  for (int k = 0; k < 20000; ++k) {
    const float tolerance = static_cast<float>(1 << triangles.any(16));
    const PullBox box(triangles.next(k % 2 == 0 ? 3 : 50, tolerance), kPullUnits / tolerance);
    float most = 0;
    for (int y = box.t.south; y <= box.t.north; ++y) {
      for (int x = box.t.west; x <= box.t.east; ++x) {
        if (!box.t.covers(x, y)) continue;
        const float off = box.t.height_above(static_cast<float>(x), static_cast<float>(y), field.height_at(x, y));
        most = std::max(most, magnitude(off) * box.per_tolerance);
      }
    }
    if (most * static_cast<float>(box.count) > 0x1p27f) continue;  // sums would not hold it
    const Pull slowly = box.all(field), at_once = eight_columns_pull(box, field);
    ASSERT_EQ(at_once.sum, slowly.sum) << k;
    ASSERT_EQ(at_once.weight, slowly.weight) << k;
    ++strides[std::min(box.stride, 4)];
    many_units += most > 0x1p22f;
  }
  EXPECT_GT(strides[1], 2000);
  EXPECT_GT(strides[2], 500);
  EXPECT_GT(strides[4], 500);
  EXPECT_GT(many_units, 50);
}

/// A window whose vertex 0 has a ring of all the others: anything that may come to an evaluation, and some that may not.
class AnyStar {
 public:
  void make(std::mt19937& random) {
    constexpr int kMiddle = 1000;
    const auto any = [&random](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
    const int valence = 3 + any(kRingWidth - 2), wide = 4 << any(6);
    std::vector<std::pair<int, int>> around;
    while (static_cast<int>(around.size()) < valence) {
      const std::pair<int, int> at{any(2 * wide + 1) - wide, any(2 * wide + 1) - wide};
      if (at != std::pair{0, 0} && std::find(around.begin(), around.end(), at) == around.end()) around.push_back(at);
    }
    const auto angle = [](const std::pair<int, int>& at) { return std::atan2(at.second, at.first); };
    std::sort(around.begin(), around.end(), [&](const auto& a, const auto& b) { return angle(a) < angle(b); });
    std::rotate(around.begin(), around.begin() + any(valence), around.end());
    view.rules.tolerance = static_cast<float>(1 << any(14));
    view.rules.least_width = 0.5f * static_cast<float>(any(3));
    view.rules.rim_reach = any(3) - 1;
    rows_[kMiddle] = {0.01f, any(2) ? 1e-5f : 0.05f, 1 / static_cast<float>(1 << any(10))};
    const float steep = static_cast<float>(any(200)), rough = static_cast<float>(1 << any(12));
    const bool voids = any(4) == 0;
    for (int v = 0; v <= valence; ++v) {
      const auto [x, y] = v == 0 ? std::pair{0, 0} : around[static_cast<std::size_t>(v - 1)];
      view.position(v) = pack_position(kMiddle + x, kMiddle + y);
      view.height(v) = std::round(steep * static_cast<float>(x) + rough * static_cast<float>(any(100)) / 100);
      view.truth(v) = view.height(v) + static_cast<float>(any(9) - 4);
      view.flag(v) = static_cast<std::uint8_t>(voids && any(3) == 0 ? kVoidHere : any(8) == 0 ? kHeldSide : 0);
      view.valence(v) = static_cast<std::uint8_t>(4 + any(9));
    }
    view.valence(0) = static_cast<std::uint8_t>(valence);
    const int line = any(8);
    view.flag(0) = static_cast<std::uint8_t>(view.flag(0) | (line < 4 ? line : 0) | (any(5) == 0 ? kOpenFan : 0) |
                                             (any(50) == 0 ? kLocked : 0));
    view.tried(0) = static_cast<std::uint16_t>(any(3) == 0 ? random() & random() & random() & ((1u << valence) - 1) : 0);
    for (int k = 0; k < valence; ++k) view.entry(0, k) = static_cast<std::uint16_t>(1 + k);
    view.target(0) = 0xff;
  }

 private:
  std::vector<std::uint64_t> storage_ = std::vector<std::uint64_t>(window_bytes(0) / 8 + 1);
  std::vector<CurveRow> rows_ = std::vector<CurveRow>(2000, CurveRow{0.01f, 1e-5f});

 public:
  WindowView view{reinterpret_cast<unsigned char*>(storage_.data()), {}, {rows_.data(), 0.01f}};
};

TEST(ExactWholeRing, SaysWhatPlaceAfterPlaceSays) {
  std::mt19937 random(23);
  AnyStar star;
  int going = 0, staying = 0, two_chunks = 0;
  for (int k = 0; k < 100000; ++k) {
    star.make(random);
    const WindowView& w = star.view;
    evaluate(w, 0, AloneLane{});
    const std::uint32_t key = w.key(0);
    const std::uint8_t target = w.target(0), state = w.state(0);
    w.key(0) = 0, w.target(0) = 0xff, w.state(0) = kStale;
    evaluate_whole_ring(w, 0);
    ASSERT_EQ(w.key(0), key) << k;
    ASSERT_EQ(w.target(0), target) << k;
    ASSERT_EQ(w.state(0), state) << k;
    ++(key == kNever ? staying : going);
    two_chunks += key != kNever && target >= 8;
  }
  EXPECT_GT(going, 5000);
  EXPECT_GT(staying, 5000);
  EXPECT_GT(two_chunks, 100);
}

}  // namespace
}  // namespace cordillera::gpu::exact
