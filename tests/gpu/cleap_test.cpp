// The published algorithm whole: laws over options, the same bits whatever the threads, hashes that a GPU gave too.
#include "gpu/cleap/cleap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "gpu/cleap/pool_maker.h"
#include "gpu/cleap/working_mesh.h"
#include "gpu/fit/steps/host_steps.h"
#include "gpu/fit/vertical_error.h"
#include "tests/bench/mesh_hash.h"
#include "tests/bench/terrain.h"

namespace cordillera::gpu::cleap {
namespace {

using bench::hash_of;

using fit::HeightMesh;

/// off: where it is cut out; at 300 the alpine kind is no sea.
HeightMesh terrain(bench::Terrain kind, std::uint32_t side, std::uint32_t off = 300) {
  HeightMesh mesh;
  for (std::uint32_t i = 0; i < side * side; ++i) {
    mesh.x.push_back(i % side * 30.0);
    mesh.y.push_back(i / side * 30.0);
    mesh.z.push_back(bench::terrain_height(kind, i % side + off, i / side + off) / 1024.0);
    if (i % side + 1 == side || i / side + 1 == side) continue;
    mesh.triangles.push_back({i, i + 1, i + side + 1});
    mesh.triangles.push_back({i, i + side + 1, i + side});
  }
  return mesh;
}

double area_of(const HeightMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  return ((mesh.x[t[1]] - mesh.x[t[0]]) * (mesh.y[t[2]] - mesh.y[t[0]]) -
          (mesh.y[t[1]] - mesh.y[t[0]]) * (mesh.x[t[2]] - mesh.x[t[0]])) /
         2;
}

/// The first law a result breaks: triangles look up, cover the square once, and no edge has two on the same side.
std::string broken_law(const HeightMesh& in, const HeightMesh& out) {
  std::map<std::array<std::uint32_t, 2>, int> edges;
  std::vector<bool> used(out.vertices());
  double area = 0, before = 0;
  for (const auto& t : in.triangles) before += area_of(in, t);
  for (const auto& t : out.triangles) {
    area += area_of(out, t);
    if (!(area_of(out, t) > 0)) return "a triangle is turned";
    for (std::size_t k = 0; k < 3; ++k) {
      used.at(t[k]) = true;
      if (++edges[{t[k], t[(k + 1) % 3]}] > 1) return "two triangles on one side of an edge";
    }
  }
  if (std::count(used.begin(), used.end(), false) > 0) return "a vertex without triangles";
  if (std::abs(area / before - 1) > 1e-9) return "the plan is not covered once";
  return "";
}

Simplified simplified(const HeightMesh& mesh, const CollapseTarget& target, Options options) {
  options.device = "cpu";
  auto made = simplify(mesh, target, options);
  EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.problem().line());
  return made.ok() ? std::move(*made) : Simplified{};
}

struct Way {
  const char* name;
  Options options;
};

Options with(const std::function<void(Options&)>& change) {
  Options options;
  change(options);
  return options;
}

std::vector<Way> ways() {
  std::vector<Way> ways = {
      {"as published", {}},
      {"raced", with([](Options& o) { o.lock = Lock::raced; })},
      {"one after the other", with([](Options& o) { o.window = 1, o.repair = Repair::around; })},
      {"all at once",
       with([](Options& o) { o.window = 0, o.come_back = true, o.shuffle = Shuffle::keyed, o.repair = Repair::around; })},
      {"independent set", with([](Options& o) { o.window = 0, o.come_back = true, o.shuffle = Shuffle::none; })},
      {"threshold", with([](Options& o) { o.selection = Selection::histogram, o.pool = 0.3; })},
      {"unsorted", with([](Options& o) { o.selection = Selection::unsorted; })},
      {"best at both ends", with([](Options& o) { o.selection = Selection::vertex_best, o.window = 0; })},
      {"super-independent", with([](Options& o) { o.selection = Selection::super_independent, o.window = 0, o.pool = 0.5; })},
      {"closing", with([](Options& o) { o.closing = true, o.window = 2000; })},
      {"closing, raced", with([](Options& o) { o.closing = true, o.lock = Lock::raced; })},
      {"border", with([](Options& o) { o.border = Border::collapse; })},
      {"delaunay between", with([](Options& o) { o.delaunay = Delaunay::between, o.pool = 0.1; })},
      {"crowd", with([](Options& o) { o.most_triangles = 9; })},
  };
  for (const auto& [name, help] : metrics()) ways.push_back({"metric", with([&name = name](Options& o) { o.metric = name; })});
  return ways;
}

TEST(Cleap, KeepsItsLawsInEveryWay) {
  for (const bench::Terrain kind : {bench::Terrain::alpine, bench::Terrain::islands}) {
    const HeightMesh mesh = terrain(kind, 60);
    for (const Way& way : ways()) {
      SCOPED_TRACE(std::string(way.name) + " " + way.options.metric);
      const Simplified result = simplified(mesh, {1000, 0}, way.options);
      const Report& report = result.report;
      EXPECT_EQ(broken_law(mesh, result.mesh), "");
      EXPECT_EQ(report.collapses, 1000u);
      EXPECT_EQ(result.mesh.vertices(), mesh.vertices() - 1000);
      EXPECT_EQ(result.mesh.triangles.size(), mesh.triangles.size() - 2 * report.fates[0] - report.fates[1]);
      EXPECT_EQ(report.fates[1] > 0, way.options.border == Border::collapse);
      std::vector<int> at(result.mesh.vertices());
      for (const auto& t : result.mesh.triangles) {
        for (const std::uint32_t v : t) ++at[v];
      }
      const bool flipped = way.options.delaunay != Delaunay::none;
      EXPECT_LE(*std::max_element(at.begin(), at.end()), flipped ? 100 : way.options.most_triangles);
    }
  }
}

TEST(Cleap, GoesOnInPassesToAFewTriangles) {
  const HeightMesh mesh = terrain(bench::Terrain::rolling, 60);
  const Simplified result = simplified(mesh, {0, mesh.triangles.size() / 10}, {});
  EXPECT_EQ(result.mesh.triangles.size(), mesh.triangles.size() / 10);
  EXPECT_GT(result.report.passes, 1u);
  EXPECT_EQ(broken_law(mesh, result.mesh), "");
  Options once;
  once.most_passes = 1;
  EXPECT_GT(simplified(mesh, {0, 1}, once).mesh.triangles.size(), mesh.triangles.size() / 10) << "a pool of one pass is used up";
}

TEST(Cleap, GivesTheSameBitsWithAnyThreadsAndRepairs) {
  const HeightMesh mesh = terrain(bench::Terrain::alpine, 80);
  for (const Way& way : ways()) {
    if (way.options.lock == Lock::raced) continue;
    SCOPED_TRACE(std::string(way.name) + " " + way.options.metric);
    const std::uint64_t hash = hash_of(simplified(mesh, {2500, 0}, way.options).mesh);
    Options other = way.options;
    other.threads = 3;
    other.repair = way.options.repair == Repair::around ? Repair::everywhere : Repair::around;
    if (way.options.window == 1) other.repair = Repair::around;
    EXPECT_EQ(hash_of(simplified(mesh, {2500, 0}, other).mesh), hash);
  }
}

// What thesis_bench gave on an NVIDIA H200 (CUDA 13.0), on 2026-11-21, for the same runs at --side 300.
TEST(Cleap, GivesTheBitsThatAGpuGave) {
  const HeightMesh mesh = terrain(bench::Terrain::alpine, 300, 0);
  EXPECT_EQ(hash_of(simplified(mesh, {30000, 0}, with([](Options& o) { o.repair = Repair::around; })).mesh), 0xa8f3afc980b7c827u);
  EXPECT_EQ(hash_of(simplified(mesh, {30000, 0}, with([](Options& o) { o.window = 4096, o.border = Border::collapse; })).mesh),
            0xe6320f1bd41e6eaeu);
  EXPECT_EQ(hash_of(simplified(mesh, {0, 20000}, with([](Options& o) { o.window = 4096, o.metric = "qem-best"; })).mesh),
            0x82a54faa5e1ba508u);
  EXPECT_EQ(hash_of(simplified(mesh, {6000, 0}, with([](Options& o) { o.inversion = Inversion::normals; })).mesh),
            0x76ca3039e5f40165u);
  const auto centres = with([](Options& o) { o.window = 0, o.selection = Selection::super_independent, o.pool = 0.3; });
  EXPECT_EQ(hash_of(simplified(mesh, {30000, 0}, centres).mesh), 0x4649accf5e73ac5au);
}

/// The vertex, its neighbours and theirs.
std::set<std::int32_t> within_two(const Arrays& mesh, std::int32_t v) {
  std::set<std::int32_t> near, far;
  each_around(mesh, v, [&](std::int32_t w) { near.insert(w); });
  for (const std::int32_t w : near) each_around(mesh, w, [&](std::int32_t x) { far.insert(x); });
  return far;
}

TEST(Cleap, SuperIndependentEdgesHaveEndsThreeEdgesApart) {
  fit::HostSteps device(1);
  WorkingMesh<fit::HostSteps> work(device);
  work.load(terrain(bench::Terrain::alpine, 40));
  ASSERT_TRUE(work.connect(false));
  work.sum_planes();
  const Arrays& mesh = work.arrays();
  PoolMaker<fit::HostSteps> maker(device);
  const std::uint32_t count =
      maker.make<QuadricAtMiddle>(mesh, with([](Options& o) { o.selection = Selection::super_independent, o.pool = 1; }), 0);
  EXPECT_GT(count, 40u * 40 / 19) << "a set that takes no more in has at least as many as there are stars of two rings";
  std::vector<std::array<std::set<std::int32_t>, 2>> around;
  for (std::uint32_t k = 0; k < count; ++k) {
    const Edge& edge = mesh.edge[maker.data()[k]];
    around.push_back({within_two(mesh, edge.n[0]), within_two(mesh, edge.n[1])});
  }
  for (std::uint32_t k = 0; k < count; ++k) {
    for (std::uint32_t i = 0; i < k; ++i) {
      const Edge& other = mesh.edge[maker.data()[i]];
      bool apart = false;
      for (const auto& near : around[k]) apart = apart || !near.contains(other.n[0]) || !near.contains(other.n[1]);
      EXPECT_TRUE(apart) << "edges " << maker.data()[k] << " and " << maker.data()[i];
    }
  }
}

TEST(Cleap, TwoPointersAndTheScanAgree) {
  const HeightMesh mesh = terrain(bench::Terrain::alpine, 60);
  Options pointers;
  pointers.rearrange = Rearrange::pointers;
  EXPECT_EQ(hash_of(simplified(mesh, {900, 0}, pointers).mesh), hash_of(simplified(mesh, {900, 0}, {}).mesh));
}

TEST(Cleap, SeedsDifferAndWindowsTellWhatTheyDid) {
  const HeightMesh mesh = terrain(bench::Terrain::alpine, 60);
  Options options;
  options.each_window = true;
  const Simplified one = simplified(mesh, {1000, 0}, options);
  std::uint64_t sum = 0;
  for (const std::uint32_t count : one.report.window_collapses) sum += count;
  EXPECT_EQ(one.report.window_collapses.size(), one.report.iterations);
  EXPECT_EQ(sum, 1000u);
  options.seed = 2;
  EXPECT_NE(hash_of(simplified(mesh, {1000, 0}, options).mesh), hash_of(one.mesh));
}

TEST(Cleap, QuadricsKeepTheShapeBetterThanLengths) {
  const HeightMesh mesh = terrain(bench::Terrain::alpine, 100);
  const auto rmse = [&](const char* metric) {
    Options options;
    options.metric = metric;
    options.pool = 0.4;
    const HeightMesh made = simplified(mesh, {5000, 0}, options).mesh;
    return vertical_error({made.x, made.y, made.z, made.triangles}, {mesh.x, mesh.y, mesh.z}).rmse;
  };
  EXPECT_LT(rmse("qem"), 0.8 * rmse("length"));
  EXPECT_LT(rmse("qem-best"), rmse("qem"));
}

TEST(Cleap, FlipsMakeAnglesAndSmoothingMakesHeightsEven) {
  const HeightMesh mesh = terrain(bench::Terrain::alpine, 60);
  const auto least_angle = [](const HeightMesh& of) {
    double sum = 0;
    for (const auto& t : of.triangles) {
      double longest = 0, around = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double length = std::hypot(of.x[t[k]] - of.x[t[(k + 1) % 3]], of.y[t[k]] - of.y[t[(k + 1) % 3]]);
        longest = std::max(longest, length);
        around += length * length;
      }
      sum += area_of(of, t) / around;
    }
    return sum / static_cast<double>(of.triangles.size());
  };
  Options options;
  const HeightMesh plain = simplified(mesh, {1500, 0}, options).mesh;
  options.delaunay = Delaunay::at_end;
  const HeightMesh flipped = simplified(mesh, {1500, 0}, options).mesh;
  EXPECT_EQ(broken_law(mesh, flipped), "");
  EXPECT_EQ(flipped.x, plain.x);
  EXPECT_GT(least_angle(flipped), 1.02 * least_angle(plain));
  const auto smoothed = smooth(plain, 5);
  ASSERT_TRUE(smoothed.ok());
  EXPECT_NE(smoothed->z, plain.z);
  EXPECT_EQ(smoothed->z[0], plain.z[0]) << "a corner stays";
}

TEST(Cleap, RefusesWhatItCannotTake) {
  HeightMesh mesh = terrain(bench::Terrain::alpine, 8);
  const auto type = [&](const Options& options) {
    const auto made = simplify(mesh, {1, 0}, options);
    return made.ok() ? std::string("taken") : made.problem().type;
  };
  EXPECT_EQ(type(with([](Options& o) { o.metric = "beauty"; })), "option-invalid");
  EXPECT_EQ(type(with([](Options& o) { o.pool = 0; })), "option-invalid");
  EXPECT_EQ(type(with([](Options& o) { o.most_triangles = 2; })), "option-invalid");
  EXPECT_EQ(type(with([](Options& o) { o.device = "abacus"; })), "unknown-device");
  mesh.triangles.push_back(mesh.triangles[5]);
  EXPECT_EQ(type(with([](Options& o) { o.device = "cpu"; })), "mesh-not-manifold");
}

}  // namespace
}  // namespace cordillera::gpu::cleap
