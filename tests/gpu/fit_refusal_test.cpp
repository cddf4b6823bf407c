// What the fit does not take, and what it says of it.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "gpu/fit/simplify_height_grid.h"
#include "tests/gpu/fit_judge.h"

namespace cordillera::gpu::fit {
namespace {

std::string refusal(const HeightMesh& mesh, const MeshTarget& target = MeshTarget::keep(0.5), const std::string& device = "cpu") {
  const auto result = simplify(mesh, target, {.device = device});
  return result.ok() ? "" : result.problem().type + ": " + result.problem().detail;
}

TEST(Fit, WhatIsNoHeightFieldIsRefusedByName) {
  const HeightMesh good = terrain(bench::Terrain::rolling, 5);
  HeightMesh bad = good;
  bad.z[7] = std::nan("");
  EXPECT_EQ(refusal(bad), "mesh-not-finite: vertex 7 holds NaN or infinity");
  bad = good;
  bad.triangles[3][1] = 99;
  EXPECT_EQ(refusal(bad), "mesh-broken: triangle 3 names vertex 99; there are 25");
  bad = good;
  std::swap(bad.triangles[4][0], bad.triangles[4][1]);
  EXPECT_EQ(refusal(bad), "mesh-not-height-field: triangle 4 turns the other way than triangle 0");
  bad = good;
  bad.triangles.push_back(bad.triangles[2]);
  EXPECT_EQ(refusal(bad), "mesh-not-manifold: triangles 2 and 32 lie on the same side of the edge from vertex 1 to vertex 2");
  bad = good;
  bad.x.push_back(0), bad.y.push_back(0), bad.z.push_back(0);
  EXPECT_EQ(refusal(bad), "mesh-broken: vertex 25 belongs to no triangle");
  EXPECT_EQ(refusal({}), "mesh-broken: the mesh has no triangles");
}

TEST(Fit, TwoFansAtAVertexAreRefused) {
  HeightMesh bow;
  bow.x = {0, 10, 10, -10, -10};
  bow.y = {0, -5, 5, 5, -5};
  bow.z = {0, 0, 0, 0, 0};
  bow.triangles = {{0, 1, 2}, {0, 3, 4}};
  EXPECT_EQ(refusal(bow), "mesh-not-manifold: the triangles at vertex 0 form more than one fan");
}

TEST(Fit, SheetsAboveEachOtherAreRefused) {
  HeightMesh two = grid(9, 9, 10, [](double, double) { return 0.0; });
  const HeightMesh above = grid(3, 3, 11, [](double, double) { return 50.0; });
  const auto first = static_cast<std::uint32_t>(two.vertices());
  for (std::size_t v = 0; v < above.vertices(); ++v)
    two.x.push_back(above.x[v] + 23), two.y.push_back(above.y[v] + 23), two.z.push_back(50);
  for (const auto& t : above.triangles) two.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  EXPECT_TRUE(refusal(two).starts_with("mesh-not-height-field: the surface lies over itself at vertex ")) << refusal(two);
}

TEST(Fit, TwoHeightsAtOnePlaceAreRefused) {
  HeightMesh two = grid(9, 9, 10, [](double, double) { return 0.0; });
  const HeightMesh above = grid(9, 9, 10, [](double, double) { return 50.0; });
  for (std::size_t v = 0; v < above.vertices(); ++v)
    two.x.push_back(above.x[v]), two.y.push_back(above.y[v]), two.z.push_back(50);
  for (const auto& t : above.triangles) two.triangles.push_back({t[0] + 81, t[1] + 81, t[2] + 81});
  EXPECT_EQ(refusal(two), "mesh-not-height-field: vertex 0 and vertex 81 lie above each other");
}

/// A mesh of 40 m with a triangle far away, or a vertex without data.
TEST(Fit, AnErrorThatIsNotReachedIsRefused) {
  const HeightMesh good = grid(41, 41, 1, [](double x, double y) { return 8 * std::sin(x * 0.7) * std::cos(y * 0.5); });
  const auto with_stray = [&](double at) {
    HeightMesh mesh = good;
    const auto first = static_cast<std::uint32_t>(mesh.vertices());
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}})
      mesh.x.push_back(at + x), mesh.y.push_back(at + y), mesh.z.push_back(0);
    mesh.triangles.push_back({first, first + 1, first + 2});
    return mesh;
  };
  EXPECT_EQ(refusal(with_stray(-1e3), MeshTarget::error_m(0.1)), "");
  EXPECT_TRUE(refusal(with_stray(-5e6), MeshTarget::error_m(0.01))
                  .starts_with("bad-target: no surface was found within the error: vertex "));
  for (const double none : {-9999.0, -3.4028234663852886e38}) {
    HeightMesh mesh = good;
    mesh.z[900] = none;
    const auto made = simplify(mesh, MeshTarget::error_m(0.1), {.device = "cpu"});
    EXPECT_EQ(made.ok(), none == -9999.0) << none;
    if (made.ok())
      EXPECT_LE(vertical_error({made->mesh.x, made->mesh.y, made->mesh.z, made->mesh.triangles}, {mesh.x, mesh.y, mesh.z}).max,
                0.1);
  }
  EXPECT_EQ(refusal(good, MeshTarget::error_m(0)), "") << "heights are floats";
}

/// A survey with a triangle at the origin of its coordinates: nearly all vertices lie in a few bins.
TEST(Fit, ACrowdIsRefusedBeforeItTakesHours) {
  HeightMesh mesh = grid(201, 201, 30, [](double x, double y) { return std::sin(x * 0.01) + std::cos(y * 0.02); });
  for (std::size_t v = 0; v < mesh.vertices(); ++v) mesh.x[v] += 5e6, mesh.y[v] += 4.9e7;
  const auto first = static_cast<std::uint32_t>(mesh.vertices());
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {30.0, 0.0}, {0.0, 30.0}})
    mesh.x.push_back(x), mesh.y.push_back(y), mesh.z.push_back(0);
  mesh.triangles.push_back({first, first + 1, first + 2});
  EXPECT_EQ(refusal(mesh),
            "mesh-too-scattered: nearly all vertices lie in a small part of the mesh; vertex 40401 is the farthest from there");
}

TEST(Fit, AVertexWithTooManyEdgesIsNamed) {
  constexpr std::uint32_t kAround = 300;
  HeightMesh fan;
  for (std::uint32_t k = 0; k < kAround; ++k) {
    const double angle = 2 * std::acos(-1) * k / kAround;
    fan.x.push_back(100 * std::cos(angle)), fan.y.push_back(100 * std::sin(angle)), fan.z.push_back(0);
    fan.triangles.push_back({kAround, k, (k + 1) % kAround});
  }
  fan.x.push_back(0.5), fan.y.push_back(0), fan.z.push_back(1);
  EXPECT_EQ(refusal(fan), "mesh-not-manifold: vertex 300 has 300 edges");
  fan.triangles.pop_back();
  EXPECT_EQ(refusal(fan), "mesh-not-manifold: vertex 300 has 300 edges") << "at a border there is one more than triangles";
}

TEST(Fit, TargetsAndDevicesAreRefusedByName) {
  const HeightMesh good = terrain(bench::Terrain::rolling, 5);
  EXPECT_TRUE(refusal(good, MeshTarget::keep(0)).starts_with("bad-target"));
  EXPECT_TRUE(refusal(good, MeshTarget::keep(1.5)).starts_with("bad-target"));
  EXPECT_TRUE(refusal(good, MeshTarget::triangles(0)).starts_with("bad-target"));
  EXPECT_TRUE(refusal(good, MeshTarget::error_m(-1)).starts_with("bad-target"));
  EXPECT_TRUE(refusal(good, MeshTarget::keep(0.5), "gpu").starts_with("unknown-device"));
}

TEST(Fit, GridsAreRefusedByName) {
  auto simplifier = GridSimplifier::make("cpu");
  std::vector<float> z(12, 1);
  const auto refused = [&](const HeightGrid& from) {
    const auto result = simplifier->simplify(from, MeshTarget::keep(0.5));
    return result.ok() ? "" : result.problem().type + ": " + result.problem().detail;
  };
  EXPECT_EQ(refused({z.data(), false, 4, 3}), "");
  EXPECT_EQ(refused({z.data(), false, 12, 1}), "grid-broken: the grid has 12 columns and 1 rows, or cells without a size");
  EXPECT_EQ(refused({z.data(), false, 4, 3, 0, 0, 0, 1}),
            "grid-broken: the grid has 4 columns and 3 rows, or cells without a size");
  z[7] = std::nanf("");
  EXPECT_EQ(refused({z.data(), false, 4, 3}), "grid-not-finite: sample 7 is NaN or infinity");
}

}  // namespace
}  // namespace cordillera::gpu::fit
