// Meshes of several tiles: what is welded, what is cut, what is refused, and the files that come of it.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "pipeline/encode/decode.h"
#include "pipeline/encode/glb.h"
#include "pipeline/encode/json.h"
#include "pipeline/exports/mesh/mesh_extract.h"
#include "pipeline/exports/mesh/mesh_output.h"
#include "proto/mesh_file/mesh_file.h"
#include "tests/pipeline/archive_readers.h"
#include "tests/pipeline/drc_point.h"
#include "tests/pipeline/exports_dataset.h"

namespace cordillera::pipeline::exports {
namespace {

using namespace pipeline::testing;
using proto::TriangleMesh;
using Edge = std::array<std::uint32_t, 2>;

ExtractedMesh extracted(const ExportDataset& dataset, const MeshRequest& request) {
  auto mesh = extract_mesh(dataset.terrain(), request);
  EXPECT_TRUE(mesh.ok()) << (mesh.ok() ? "" : mesh.problem().line());
  return mesh.ok() ? *mesh : ExtractedMesh{};
}

/// Directed edges without a neighbour. An edge that goes one way twice is a failure.
std::set<Edge> rims(const TriangleMesh& mesh) {
  std::map<Edge, int> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  std::set<Edge> alone;
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    if (!edges.contains({edge[1], edge[0]})) alone.insert(edge);
  }
  return alone;
}

double plan_area(const TriangleMesh& m) {
  double sum = 0;
  for (const auto& [a, b, c] : m.triangles)
    sum += ((m.x[b] - m.x[a]) * (m.y[c] - m.y[a]) - (m.y[b] - m.y[a]) * (m.x[c] - m.x[a])) / 2;
  return sum;
}

MeshRequest whole_level(int level, MeshFrame frame = MeshFrame::geodetic) {
  MeshRequest request;
  request.level = level;
  request.frame = frame;
  return request;
}

TEST(MeshExport, TilesShareTheVerticesOfTheirSides) {
  const ExtractedMesh all = extracted(plain_dataset(), whole_level(7));
  // 6 x 6 tiles of 8 x 8 cells.
  EXPECT_EQ(all.mesh.vertices(), 49u * 49u);
  EXPECT_EQ(all.mesh.triangles.size(), 2u * 48u * 48u);
  std::set<std::array<double, 3>> places;
  for (std::size_t v = 0; v < all.mesh.vertices(); ++v) places.insert({all.mesh.x[v], all.mesh.y[v], all.mesh.z[v]});
  EXPECT_EQ(places.size(), all.mesh.vertices());
  EXPECT_EQ(rims(all.mesh).size(), 4u * 48u) << "a crack inside";
}

TEST(MeshExport, PositionsAreTheTilesOwn) {
  const proto::TileAddress tile{7, 128, 83};
  MeshRequest request;
  request.tile = tile;
  request.frame = MeshFrame::geodetic;
  const ExtractedMesh one = extracted(plain_dataset(), request);
  const auto decoded = decode_drc(plain_dataset().terrain().store().tile(tile, Encoding::drc)->bytes);
  ASSERT_EQ(one.mesh.triangles.size(), decoded->triangles.size());
  for (std::size_t t = 0; t < decoded->triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const DrcPoint wanted = drc_point(*decoded, decoded->triangles[t][k]);
      const std::uint32_t v = one.mesh.triangles[t][k];
      EXPECT_NEAR(one.mesh.x[v], wanted.longitude_deg, 1e-12);
      EXPECT_NEAR(one.mesh.y[v], wanted.latitude_deg, 1e-12);
      EXPECT_EQ(one.mesh.z[v], wanted.height_m);
    }
  }
}

TEST(MeshExport, RimsThatTouchKeepVerticesOfTheirOwn) {
  const ExtractedMesh all = extracted(holed_dataset(), whole_level(7));
  std::map<std::uint32_t, int> leaving;
  for (const Edge& edge : rims(all.mesh)) ++leaving[edge[0]];
  for (const auto& [vertex, count] : leaving) EXPECT_EQ(count, 1) << "two rims pass through one vertex";
  EXPECT_GT(leaving.size(), 4u * 48u) << "there are no holes, so this test says nothing";
}

TEST(MeshExport, ABoxIsCutExactly) {
  for (const raster::Area& box : {raster::Area{-1.3, 23.1, 2.7, 28.9}, raster::Area{0.31, 25.01, 0.44, 25.2},
                                  raster::Area{-2.8125, 22.5, 1.40625, 25.3125}}) {
    MeshRequest request = whole_level(7);
    request.box = box;
    const TriangleMesh mesh = extracted(plain_dataset(), request).mesh;
    const double area = (box.east_deg - box.west_deg) * (box.north_deg - box.south_deg);
    EXPECT_NEAR(plan_area(mesh), area, 1e-9 * area);
    const double tiny = 1e-9;
    for (std::size_t v = 0; v < mesh.vertices(); ++v) {
      EXPECT_TRUE(mesh.x[v] > box.west_deg - tiny && mesh.x[v] < box.east_deg + tiny && mesh.y[v] > box.south_deg - tiny &&
                  mesh.y[v] < box.north_deg + tiny);
    }
    for (const auto& [from, to] : rims(mesh)) {
      const auto both = [tiny](const std::vector<double>& axis, std::uint32_t a, std::uint32_t b, double at) {
        return std::abs(axis[a] - at) < tiny && std::abs(axis[b] - at) < tiny;
      };
      EXPECT_TRUE(both(mesh.x, from, to, box.west_deg) || both(mesh.x, from, to, box.east_deg) ||
                  both(mesh.y, from, to, box.south_deg) || both(mesh.y, from, to, box.north_deg))
          << "a crack inside, or a rim that is not a side of the box";
    }
  }
}

/// The least height of a triangle over its longest side, in cells of the level.
double narrowest_cells(const TriangleMesh& m, double cell) {
  double least = INFINITY;
  for (const auto& t : m.triangles) {
    double longest = 0, area = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      longest = std::max(longest, std::hypot(m.x[b] - m.x[a], m.y[b] - m.y[a]));
      area += (m.x[a] * m.y[b] - m.x[b] * m.y[a]) / 2;
    }
    least = std::min(least, 2 * area / longest / cell);
  }
  return least;
}

/// Bounds of a tile with ten decimals, and boxes whose corners lie on edges: sides that are nearly, and not quite, where vertices
/// are.
TEST(MeshExport, ABoxAHairBesideVerticesLeavesNoNeedles) {
  const double cell = kExportLattice.cell_deg();
  for (const double beside_deg : {0.0, 1e-13, -1e-13, 3e-10, -3e-10, 4e-8}) {
    MeshRequest request = whole_level(7);
    request.box =
        raster::Area{-1.40625 + beside_deg, 23.90625 - beside_deg, 0.5 * cell + beside_deg, 25.3125 + 0.5 * cell + beside_deg};
    const TriangleMesh mesh = extracted(plain_dataset(), request).mesh;
    ASSERT_GT(mesh.triangles.size(), 100u);
    EXPECT_GT(narrowest_cells(mesh, cell), 1.0 / 1024) << beside_deg;
    std::set<std::pair<double, double>> places;
    for (std::size_t v = 0; v < mesh.vertices(); ++v) places.emplace(mesh.x[v], mesh.y[v]);
    EXPECT_EQ(places.size(), mesh.vertices()) << "two vertices are at one place";
    rims(mesh);
  }
}

TEST(MeshExport, LocalCoordinatesAreAboutTheData) {
  MeshRequest request = whole_level(7, MeshFrame::enu);
  const ExtractedMesh all = extracted(plain_dataset(), request);
  request.box = raster::Area{-180, -90, 180, 90};
  const ExtractedMesh boxed = extracted(plain_dataset(), request);
  EXPECT_EQ(boxed.longitude_deg, all.longitude_deg);
  EXPECT_EQ(boxed.latitude_deg, all.latitude_deg);
  EXPECT_EQ(boxed.mesh.z, all.mesh.z);
  request = {};
  request.tile = proto::TileAddress{0, 0, 0};
  const ExtractedMesh root = extracted(plain_dataset(), request);
  EXPECT_GT(root.latitude_deg, 20) << "of the data within the tile, and not of the tile";
}

TEST(MeshExport, FramesDescribeTheSamePoints) {
  MeshRequest request = whole_level(7);
  request.box = raster::Area{-0.7, 24.6, 0.9, 25.5};
  const ExtractedMesh degrees = extracted(plain_dataset(), request);
  request.frame = MeshFrame::ecef;
  const ExtractedMesh ecef = extracted(plain_dataset(), request);
  request.frame = MeshFrame::enu;
  const ExtractedMesh enu = extracted(plain_dataset(), request);
  EXPECT_NEAR(enu.longitude_deg, 0.1, 0.01);
  EXPECT_NEAR(enu.latitude_deg, 25.05, 0.01);
  ASSERT_EQ(ecef.mesh.triangles, degrees.mesh.triangles);
  ASSERT_EQ(enu.mesh.triangles, degrees.mesh.triangles);
  const double rad = std::acos(-1) / 180, lon0 = enu.longitude_deg * rad, lat0 = enu.latitude_deg * rad;
  const double e2 = proto::kFlattening * (2 - proto::kFlattening);
  double worst_m = 0;
  for (std::size_t v = 0; v < degrees.mesh.vertices(); ++v) {
    // What the box added is linear in each frame: compare where both mean the same.
    const double lon = degrees.mesh.x[v] * rad, lat = degrees.mesh.y[v] * rad, h = degrees.mesh.z[v];
    if (std::fmod(degrees.mesh.x[v], kExportLattice.cell_deg()) != 0 ||
        std::fmod(degrees.mesh.y[v], kExportLattice.cell_deg()) != 0)
      continue;
    const double n = proto::kSemiMajor_m / std::sqrt(1 - e2 * std::sin(lat) * std::sin(lat));
    const proto::Vec3 wanted{(n + h) * std::cos(lat) * std::cos(lon), (n + h) * std::cos(lat) * std::sin(lon),
                             (n * (1 - e2) + h) * std::sin(lat)};
    const proto::Vec3 at{ecef.mesh.x[v], ecef.mesh.y[v], ecef.mesh.z[v]};
    const proto::Vec3 off = at - wanted, from = at - ecef.origin_m;
    worst_m = std::max(worst_m, std::sqrt(dot(off, off)));
    EXPECT_NEAR(enu.mesh.x[v], dot(from, {-std::sin(lon0), std::cos(lon0), 0}), 1e-4);
    EXPECT_NEAR(enu.mesh.y[v], dot(from, {-std::sin(lat0) * std::cos(lon0), -std::sin(lat0) * std::sin(lon0), std::cos(lat0)}),
                1e-4);
    EXPECT_NEAR(enu.mesh.z[v], dot(from, {std::cos(lat0) * std::cos(lon0), std::cos(lat0) * std::sin(lon0), std::sin(lat0)}),
                1e-4);
  }
  EXPECT_LT(worst_m, 0.001);
  EXPECT_GT(worst_m, 0.0) << "nothing was compared";
}

TEST(MeshExport, TheFinestLevelThatFitsIsTaken) {
  MeshRequest request;
  EXPECT_EQ(extracted(plain_dataset(), request).level, 7);
  request.most_triangles = 4607;
  EXPECT_EQ(extracted(plain_dataset(), request).level, 6);
  request.level = 7;
  const auto refused = extract_mesh(plain_dataset().terrain(), request);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "mesh-too-large");
  EXPECT_NE(refused.problem().accepted.find("level 6"), std::string::npos) << refused.problem().accepted;
  request.most_triangles = 4608;
  EXPECT_EQ(extracted(plain_dataset(), request).mesh.triangles.size(), 4608u);
}

TEST(MeshExport, RefusalsSayWhy) {
  const auto slug = [](const MeshRequest& request) {
    const auto mesh = extract_mesh(plain_dataset().terrain(), request);
    return mesh.ok() ? "" : mesh.problem().type;
  };
  MeshRequest request = whole_level(8);
  EXPECT_EQ(slug(request), "option-invalid");
  request = {};
  request.tile = proto::TileAddress{7, 3, 3};
  EXPECT_EQ(slug(request), "tile-unknown");
  request.tile = proto::TileAddress{15, 3, 3};
  EXPECT_EQ(slug(request), "tile-unknown");
  request = {};
  request.box = raster::Area{100, 10, 110, 20};
  EXPECT_EQ(slug(request), "bbox-outside-raster");
  EXPECT_EQ(check_frame(MeshKind::stl, MeshFrame::ecef).ok(), false);
  EXPECT_EQ(check_frame(MeshKind::glb, MeshFrame::geodetic).ok(), false);
  EXPECT_EQ(check_frame(MeshKind::ply, MeshFrame::geodetic).ok(), true);
}

/// Rasters of a few pixels have fine levels without a triangle, and islands are dropped from coarse ones.
TEST(MeshExport, ALevelWithoutTrianglesNamesThoseThatHaveSome) {
  TemporaryFolder folder;
  {
    auto writer = StoreWriter::open(folder / "a.db", synthetic_plan(7, 5)).value();
    for (FinishedTask& task : synthetic_tasks(kExportLattice, kFirstTile, kLastTile, hills())) {
      if (task.node.z < 5) continue;
      if (task.node.z == 6) task.tiles.clear();
      ASSERT_TRUE(writer->commit(task).ok());
    }
    ASSERT_TRUE(writer->publish(synthetic_manifest()).ok());
  }
  const faces::Terrain terrain(StoreReader::open(folder / "a.db").value());
  const auto refused = extract_mesh(terrain, whole_level(6));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().line(), "level 6 of the dataset has no triangle; accepted: a level that has some: 5, 7");
  EXPECT_EQ(refused.problem().parameter, "level");
}

/// Both sides of the antimeridian are one mesh, and its degrees go on beyond 180.
TEST(MeshExport, TheAntimeridianIsNoSeam) {
  TemporaryFolder folder;
  {
    auto writer = StoreWriter::open(folder / "a.db", synthetic_plan(7, 7)).value();
    for (const std::int32_t x : {254, 255, 0, 1}) {
      for (FinishedTask& task : synthetic_tasks(kExportLattice, {7, x, 80}, {7, x, 81}, hills())) {
        if (task.node.z == 7) { ASSERT_TRUE(writer->commit(task).ok()); }
      }
    }
    ASSERT_TRUE(writer->publish(synthetic_manifest()).ok());
  }
  const faces::Terrain terrain(StoreReader::open(folder / "a.db").value());
  MeshRequest request = whole_level(7);
  request.box = raster::Area{178, 22.8, 182, 24.1};
  for (const MeshFrame frame : {MeshFrame::geodetic, MeshFrame::enu}) {
    request.frame = frame;
    const auto mesh = extract_mesh(terrain, request);
    ASSERT_TRUE(mesh.ok()) << mesh.problem().line();
    if (frame == MeshFrame::geodetic) {
      EXPECT_NEAR(plan_area(mesh->mesh), 4 * 1.3, 1e-9);
      EXPECT_NEAR(*std::max_element(mesh->mesh.x.begin(), mesh->mesh.x.end()), 182, 1e-9);
    }
    EXPECT_NEAR(std::abs(mesh->longitude_deg), 180, 1e-9);
    std::size_t inside = 0;
    const double reach = frame == MeshFrame::enu ? 199000 : 2;  // metres of two degrees there, about
    for (const auto& [from, to] : rims(mesh->mesh)) {
      const double middle = frame == MeshFrame::enu ? 0 : 180;
      inside +=
          std::abs(mesh->mesh.x[from] - middle) < 0.1 * reach && std::abs(mesh->mesh.x[to] - mesh->mesh.x[from]) < 1e-3 * reach
              ? 1
              : 0;
    }
    EXPECT_EQ(inside, 0u) << "the meridian is a rim";
  }
}

std::string written(const ExtractedMesh& mesh, MeshKind kind) {
  std::ostringstream out;
  EXPECT_TRUE(write_mesh(out, mesh, kind, plain_dataset().terrain().manifest()));
  return out.str();
}

TEST(MeshFiles, PlyAndObjReadBackAsTheSameMesh) {
  for (const auto& [kind, frame] : {std::pair{MeshKind::ply, MeshFrame::ecef},
                                    {MeshKind::obj, MeshFrame::ecef},
                                    {MeshKind::obj, MeshFrame::geodetic},
                                    {MeshKind::ply, MeshFrame::enu}}) {
    const ExtractedMesh mesh = extracted(holed_dataset(), whole_level(6, frame));
    const std::string bytes = written(mesh, kind);
    EXPECT_NE(bytes.substr(0, 300).find("Nobody <nobody@example.org>"), std::string::npos);
    std::istringstream in(bytes);
    const auto read = proto::read_mesh(in, kind == MeshKind::obj ? "a.obj" : "a.ply");
    ASSERT_TRUE(read.ok()) << read.problem().line();
    EXPECT_EQ(read->mesh.triangles, mesh.mesh.triangles);
    ASSERT_EQ(read->mesh.vertices(), mesh.mesh.vertices());
    const double most = frame == MeshFrame::enu ? 0.1 : kind == MeshKind::obj && frame == MeshFrame::ecef ? 0.0006 : 0;
    for (std::size_t v = 0; v < mesh.mesh.vertices(); ++v) {
      ASSERT_NEAR(read->mesh.x[v], mesh.mesh.x[v], most);
      ASSERT_NEAR(read->mesh.z[v], mesh.mesh.z[v], most);
    }
  }
}

TEST(MeshFiles, StlHoldsTheTrianglesFromAbove) {
  const ExtractedMesh mesh = extracted(plain_dataset(), whole_level(7, MeshFrame::enu));
  const std::string bytes = written(mesh, MeshKind::stl);
  ASSERT_EQ(bytes.size(), 84 + 50 * mesh.mesh.triangles.size());
  EXPECT_NE(bytes.substr(0, 5), "solid");
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 80), mesh.mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.mesh.triangles.size(); ++t) {
    EXPECT_GT(number_at<float>(bytes, 84 + 50 * t + 8), 0) << "a normal points down";
    const std::uint32_t second = mesh.mesh.triangles[t][1];
    EXPECT_EQ(number_at<float>(bytes, 84 + 50 * t + 24), static_cast<float>(mesh.mesh.x[second]));
    EXPECT_EQ(number_at<float>(bytes, 84 + 50 * t + 32), static_cast<float>(mesh.mesh.z[second]));
  }
}

TEST(MeshFiles, GlbHoldsPointsRelativeToItsTranslation) {
  const ExtractedMesh mesh = extracted(plain_dataset(), whole_level(7, MeshFrame::ecef));
  const std::string bytes = written(mesh, MeshKind::glb);
  const auto chunks = unpack_glb(bytes);
  ASSERT_TRUE(chunks.ok());
  const Json json = Json::parse(chunks->first);
  EXPECT_EQ(json["asset"]["copyright"], "Nobody <nobody@example.org>");
  EXPECT_FALSE(json.contains("extensionsRequired"));
  const auto translation = json["nodes"][0]["translation"].get<std::array<double, 3>>();
  ASSERT_EQ(json["accessors"][0]["count"], mesh.mesh.vertices());
  ASSERT_EQ(json["accessors"][2]["count"], 3 * mesh.mesh.triangles.size());
  const std::string binary(chunks->second);
  for (std::size_t v = 0; v < mesh.mesh.vertices(); ++v) {
    EXPECT_NEAR(number_at<float>(binary, 12 * v) + translation[0], mesh.mesh.x[v], 0.1);
    EXPECT_NEAR(number_at<float>(binary, 12 * v + 4) + translation[1], mesh.mesh.z[v], 0.1);
    EXPECT_NEAR(number_at<float>(binary, 12 * v + 8) + translation[2], -mesh.mesh.y[v], 0.1);
    const std::size_t normal = 12 * (mesh.mesh.vertices() + v);
    const double up = number_at<float>(binary, normal) * mesh.mesh.x[v] + number_at<float>(binary, normal + 4) * mesh.mesh.z[v] -
                      number_at<float>(binary, normal + 8) * mesh.mesh.y[v];
    EXPECT_GT(up, 0) << "a normal points into the earth";
  }
}

}  // namespace
}  // namespace cordillera::pipeline::exports
