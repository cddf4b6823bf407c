// Triangles between two rows of samples on a rim: left out where they lean, and only there.
#include "pipeline/encode/rim_slivers.h"

#include <gtest/gtest.h>

#include "pipeline/encode/published_mesh.h"

namespace cordillera::pipeline {
namespace {

constexpr std::uint32_t kA = 0, kB = 1, kC = 2, kD = 3, kE = 4;

/// Along the rim from A to B, with C just below the line: between the rows 4 and 5. D is south of all of them, E north.
class RimSlivers : public ::testing::Test {
 protected:
  RimSlivers() {
    mesh_.side = 8;
    mesh_.x = {1, 7, 4, 4, 4};
    mesh_.y = {4, 5, 4, 0, 8};
    mesh_.height = {0, 0, metres(20), 0, 0};
    mesh_.mark = {0, 0, 0, 0, proto::kVoid};
    mesh_.triangles = {{kA, kC, kB}, {kA, kD, kC}, {kC, kD, kB}};
  }
  static std::int32_t metres(double m) { return static_cast<std::int32_t>(m / proto::kHeightStep_m); }
  bool is_left_out(double limit_m = 10) const {
    const auto left_out = rim_slivers(mesh_, limit_m);
    return !left_out.empty() && left_out[0] != 0;
  }
  proto::TileMesh mesh_;
};

TEST_F(RimSlivers, are_left_out_where_they_lean_by_more_than_the_limit) {
  EXPECT_EQ(rim_slivers(mesh_, 19), (std::vector<std::uint8_t>{1, 0, 0}));
  EXPECT_TRUE(rim_slivers(mesh_, 21).empty());
  const PublishedMesh published = published_mesh(mesh_, rim_slivers(mesh_, 19));
  EXPECT_EQ(published.triangles.size(), 2u);
  EXPECT_EQ(published.source.size(), 4u) << "no vertex is lost";
}

TEST_F(RimSlivers, lean_from_the_line_of_the_rim_and_not_from_its_ends) {
  mesh_.height = {0, metres(40), metres(20), 0, 0};  // C is in the middle of a slope
  EXPECT_FALSE(is_left_out());
}

TEST_F(RimSlivers, are_beside_a_void_or_beside_nothing) {
  mesh_.triangles.push_back({kA, kB, kE});
  EXPECT_TRUE(is_left_out());
  mesh_.mark[kE] = 0;
  EXPECT_FALSE(is_left_out()) << "no rim is there";
}

TEST_F(RimSlivers, stay_where_a_sample_would_lose_its_triangle) {
  mesh_.triangles.erase(mesh_.triangles.begin() + 1);
  EXPECT_FALSE(is_left_out()) << "A has no other triangle";
}

TEST_F(RimSlivers, stay_where_a_row_of_samples_is_beyond) {
  mesh_.y[kC] = 3, mesh_.y[kA] = 5;  // from row 3 to row 5
  EXPECT_FALSE(is_left_out());
  mesh_.y[kC] = 4;  // the rim lies on the row 5
  EXPECT_FALSE(is_left_out());
}

TEST_F(RimSlivers, stay_where_an_edge_is_on_a_side_of_the_tile) {
  mesh_.x = {0, 6, 0, 3, 3}, mesh_.y = {5, 5, 4, 0, 8};  // from A and C, on the side, to B
  mesh_.mark.assign(5, 0);
  mesh_.triangles = {{kA, kC, kB}, {kC, kD, kB}, {kA, kB, kE}};
  EXPECT_FALSE(is_left_out());
  mesh_.triangles.pop_back();
  mesh_.mark[kE] = proto::kVoid;
  EXPECT_FALSE(is_left_out()) << "along a rim, too";
}

TEST_F(RimSlivers, stay_where_they_are_the_end_of_a_slope) {
  mesh_.x = {4, 5, 4, 2, 6}, mesh_.y = {4, 4, 0, 2, 1};  // the rim is the short edge from B to A; samples beside it say what C is
  mesh_.triangles = {{kA, kC, kB}, {kA, kD, kC}, {kC, kE, kB}};
  mesh_.mark[kE] = 0;
  EXPECT_FALSE(is_left_out());
}

TEST_F(RimSlivers, behind_one_that_is_left_out_the_next_one_may_be) {
  // Between C and B lies another, F, lower than both.
  mesh_.x.push_back(5), mesh_.y.push_back(4), mesh_.height.push_back(metres(-60)), mesh_.mark.push_back(0);
  const std::uint32_t f = 5;
  mesh_.triangles = {{kA, kC, kB}, {kC, f, kB}, {kA, kD, kC}, {kC, kD, f}, {f, kD, kB}};
  EXPECT_EQ(rim_slivers(mesh_, 10), (std::vector<std::uint8_t>{1, 1, 0, 0, 0}));
}

}  // namespace
}  // namespace cordillera::pipeline
