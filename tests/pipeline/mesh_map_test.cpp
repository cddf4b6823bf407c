// Meshes in the coordinates of a projected CRS.
#include <gtest/gtest.h>

#include <GeographicLib/UTMUPS.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "pipeline/encode/glb.h"
#include "pipeline/encode/json.h"
#include "pipeline/exports/mesh/mesh_extract.h"
#include "pipeline/exports/mesh/mesh_output.h"
#include "tests/pipeline/archive_readers.h"
#include "tests/pipeline/exports_dataset.h"

namespace cordillera::pipeline::exports {
namespace {

using namespace pipeline::testing;

constexpr raster::Area kBox{0.1, 24.6, 0.9, 25.5};

MeshRequest on_map(const std::string& code) {
  MeshRequest request;
  request.level = 7;
  request.box = kBox;
  request.frame = MeshFrame::map;
  request.map = code;
  return request;
}

/// "crs-unknown: what is accepted", or "".
std::string refusal(const faces::Terrain& terrain, const MeshRequest& request) {
  const auto mesh = extract_mesh(terrain, request);
  return mesh.ok() ? "" : mesh.problem().type + ": " + mesh.problem().accepted;
}

/// Of the west and of the east of the antimeridian.
faces::Terrain across_the_antimeridian(const TemporaryFolder& folder) {
  auto writer = StoreWriter::open(folder / "a.db", synthetic_plan(7, 7)).value();
  for (const std::int32_t x : {254, 255, 0, 1}) {
    for (FinishedTask& task : synthetic_tasks(kExportLattice, {7, x, 80}, {7, x, 81}, hills()))
      if (task.node.z == 7) EXPECT_TRUE(writer->commit(task).ok());
  }
  EXPECT_TRUE(writer->publish(synthetic_manifest()).ok());
  writer.reset();
  return faces::Terrain(StoreReader::open(folder / "a.db").value());
}

TEST(MeshOnAMap, PlacesAreThoseOfTheProjectionAndHeightsAreAboveTheGeoid) {
  MeshRequest request = on_map("EPSG:32631");
  const faces::Terrain& terrain = plain_dataset().terrain();
  const auto map = extract_mesh(terrain, request);
  ASSERT_TRUE(map.ok()) << map.problem().line();
  request.frame = MeshFrame::geodetic;
  const auto degrees = extract_mesh(terrain, request);
  ASSERT_EQ(map->mesh.triangles, degrees->mesh.triangles);
  std::size_t compared = 0;
  for (std::size_t v = 0; v < map->mesh.vertices(); ++v) {
    const double longitude = degrees->mesh.x[v], latitude = degrees->mesh.y[v];
    // What the box added is linear in each frame: compare where both mean the same.
    if (std::fmod(longitude, kExportLattice.cell_deg()) != 0 || std::fmod(latitude, kExportLattice.cell_deg()) != 0) continue;
    int zone = 0;
    bool north = false;
    double x = 0, y = 0;
    GeographicLib::UTMUPS::Forward(latitude, longitude, zone, north, x, y, 31);
    ASSERT_NEAR(map->mesh.x[v], x, 1e-3);
    ASSERT_NEAR(map->mesh.y[v], y, 1e-3);
    ASSERT_NEAR(map->mesh.z[v], degrees->mesh.z[v] - terrain.undulation_m(longitude, latitude).value(), 1e-6);
    ++compared;
  }
  EXPECT_GT(compared, 20u);
  EXPECT_EQ(map->map.code, "EPSG:32631");
  EXPECT_EQ(map->map.unit, "metre");
  EXPECT_EQ(map->map.geoid, "EGM96");
}

TEST(MeshOnAMap, AllNumbersAreInItsUnit) {
  MeshRequest request = on_map("EPSG:2225");  // feet, of California
  request.box = raster::Area{-122, 40, -121, 41};
  const ExportDataset west(hills(), {7, 41, 92}, {7, 42, 93});
  const auto feet = extract_mesh(west.terrain(), request);
  ASSERT_TRUE(feet.ok()) << feet.problem().line();
  request.map = "EPSG:26941";  // the same projection in metres
  const auto metres = extract_mesh(west.terrain(), request);
  ASSERT_TRUE(metres.ok()) << metres.problem().line();
  EXPECT_EQ(feet->map.unit, "US survey foot");
  constexpr double kFoot_m = 1200.0 / 3937;
  ASSERT_GT(feet->mesh.vertices(), 0u);
  for (std::size_t v = 0; v < feet->mesh.vertices(); ++v) {
    EXPECT_NEAR(feet->mesh.y[v] * kFoot_m, metres->mesh.y[v], 0.01);
    EXPECT_NEAR(feet->mesh.z[v] * kFoot_m, metres->mesh.z[v], 1e-6);
  }
}

TEST(MeshOnAMap, ItIsTheRastersOwnWhereNoneIsNamed) {
  const TemporaryFolder folder;
  for (const auto& [crs, wanted] :
       {std::pair{"WGS 84 / UTM zone 31N (EPSG:32631)", ""},
        {"WGS 84 (EPSG:4326)",
         "crs-unsupported: the code of a projected CRS that holds the data, such as EPSG:32631, or geodetic"},
        {"Transverse Mercator on WGS 84 (+proj=tmerc)",
         "crs-unknown: the code of a projected CRS that holds the data, such as EPSG:32631"}}) {
    const std::string file = folder / (std::string(wanted).substr(0, 8) + ".db");
    {
      auto writer = StoreWriter::open(file, synthetic_plan(7, 0)).value();
      for (const FinishedTask& task : synthetic_tasks(kExportLattice, kFirstTile, kLastTile, hills()))
        ASSERT_TRUE(writer->commit(task).ok());
      proto::Manifest manifest = synthetic_manifest();
      manifest.mutable_source()->set_crs(crs);
      ASSERT_TRUE(writer->publish(manifest).ok());
    }
    EXPECT_EQ(refusal(faces::Terrain(StoreReader::open(file).value()), on_map("")), wanted) << crs;
  }
}

TEST(MeshOnAMap, OneThatDoesNotHoldTheMeshIsRefused) {
  const faces::Terrain& terrain = plain_dataset().terrain();
  const std::string accepted = ": the code of a projected CRS that holds the data, such as EPSG:32631";
  EXPECT_EQ(refusal(terrain, on_map("EPSG:99999")), "crs-unknown" + accepted);
  EXPECT_EQ(refusal(terrain, on_map("EPSG:4326")), "crs-unsupported" + accepted + ", or geodetic");
  EXPECT_EQ(refusal(terrain, on_map("EPSG:3031")), "crs-unsupported" + accepted) << "of the Antarctic";
  EXPECT_EQ(check_frame(MeshKind::stl, MeshFrame::map).ok(), false);

  const TemporaryFolder folder;
  const faces::Terrain across = across_the_antimeridian(folder);
  MeshRequest request = on_map("EPSG:3857");  // ends there
  request.box = raster::Area{178, 22.8, 182, 24.1};
  EXPECT_EQ(refusal(across, request), "crs-unsupported: a CRS that holds it, or a smaller bbox");
  request.map = "EPSG:3832";  // the same around the Pacific
  EXPECT_EQ(refusal(across, request), "");
}

TEST(MeshOnAMap, FilesSayWhatItIsAndGlbCountsFromItsTranslation) {
  const auto mesh = extract_mesh(plain_dataset().terrain(), on_map("EPSG:32631"));
  ASSERT_TRUE(mesh.ok()) << mesh.problem().line();
  const auto written = [&](MeshKind kind) {
    std::ostringstream out;
    EXPECT_TRUE(write_mesh(out, *mesh, kind, plain_dataset().terrain().manifest()));
    return out.str();
  };
  EXPECT_NE(
      written(MeshKind::obj)
          .find("# east and north in WGS 84 / UTM zone 31N (EPSG:32631), heights above EGM96, in metre\n# crs: EPSG:32631\n"),
      std::string::npos);
  EXPECT_NE(written(MeshKind::ply).find("comment crs: EPSG:32631\n"), std::string::npos);
  const std::string bytes = written(MeshKind::glb);
  const auto chunks = unpack_glb(bytes);
  ASSERT_TRUE(chunks.ok());
  const Json json = Json::parse(chunks->first);
  EXPECT_EQ(json["extras"]["crs"], "EPSG:32631");
  EXPECT_EQ(json["extras"]["vertical_datum"], "EGM96");
  const auto translation = json["nodes"][0]["translation"].get<std::array<double, 3>>();
  const std::string binary(chunks->second);
  for (std::size_t v = 0; v < mesh->mesh.vertices(); ++v) {
    const auto at = [&](std::size_t axis) { return number_at<float>(binary, 12 * v + 4 * axis); };
    // y up: x, z, -y.
    ASSERT_NEAR(at(0) + translation[0], mesh->mesh.x[v], 0.01);
    ASSERT_NEAR(at(1) + translation[1], mesh->mesh.z[v], 0.01);
    ASSERT_NEAR(-(at(2) + translation[2]), mesh->mesh.y[v], 0.01);
  }
}

}  // namespace
}  // namespace cordillera::pipeline::exports
