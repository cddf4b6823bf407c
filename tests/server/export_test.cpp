// cordillera export and mesh.glb as users call them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "program_fixture.h"
#include "proto/mesh_file/mesh_file.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

class Export : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    const Ended built = shell(build("-o " + place("cone.sqlite") + " -q --max-level 8"));
    ASSERT_EQ(built.code, 0) << built.output;
  }
  std::string place(const std::string& name) const { return (folder_.path() / name).string(); }
  /// One colour over ten degrees from this longitude on.
  std::string write_photo(const std::string& name, const std::string& west) const {
    const auto file = [&](const char* ending) { return std::ofstream(place(name + ending), std::ios::binary); };
    file(".hdr") << "nrows 8\nncols 8\nnbands 3\nnbits 8\nlayout bip\nxdim 1.25\nydim 1.25\nulymap 50\nulxmap " << west << "\n";
    file(".prj") << R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],)"
                 << R"(PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
    file(".bil") << std::string(192, 'x');
    return place(name + ".bil");
  }
  Ended exported(const std::string& arguments) { return shell(kProgram + " export " + place("cone.sqlite") + " " + arguments); }
};

TEST_F(Export, EveryEndingIsAFile) {
  for (const auto& [name, magic] : std::map<std::string, std::string>{{"a.pmtiles", "PMTiles\3"},
                                                                      {"a.3tz", "PK\3\4"},
                                                                      {"a.glb", "glTF"},
                                                                      {"a.ply", "ply\n"},
                                                                      {"a.obj", "# "},
                                                                      {"a.stl", "Cordillera"}}) {
    const Ended ended = exported("-o " + place(name));
    ASSERT_EQ(ended.code, 0) << ended.output;
    EXPECT_THAT(ended.output, HasSubstr("written to " + place(name)));
    EXPECT_EQ(file_text(place(name)).substr(0, magic.size()), magic);
  }
  EXPECT_THAT(exported("-o " + place("a.glb")).output, HasSubstr("--overwrite"));
  EXPECT_EQ(exported("-o " + place("a.glb") + " --overwrite -q").output, "");
  const Ended raster = shell(kProgram + " export " + raster_ + " -o " + place("b.pmtiles"));
  EXPECT_EQ(raster.code, 1);
  EXPECT_THAT(raster.output,
              HasSubstr("is a raster, and export takes what was built of one; accepted: cordillera build " + raster_));
}

/// Beyond 2 MB SQLite writes while tiles still come, and cannot undo it there.
TEST_F(Export, AFullDiskLeavesNothingBeside) {
  const std::string disk = place("disk"), file = disk + "/a.mbtiles";
  ASSERT_EQ(shell(build("-o " + place("large.sqlite") + " -q --max-level 12")).code, 0);
  const Ended full = shell("mkdir " + disk + " && unshare -rm sh -c 'mount -t tmpfs -o size=100k none " + disk + " || exit 77; " +
                           kProgram + " export " + place("large.sqlite") + " -q -o " + file +
                           " --format terrain-rgb; echo ended with $?; ls -A " + disk + "'");
  if (full.code == 77 || full.output.starts_with("unshare: ")) GTEST_SKIP() << "no disk of its own may be mounted here";
  EXPECT_THAT(full.output, testing::StartsWith("cordillera: cannot write " + file + ": the disk is full"));
  EXPECT_THAT(full.output, testing::EndsWith("\nended with 1\n")) << "with nothing on the disk";
}

/// One command from the raster to the file: the same bytes as by way of a dataset.
TEST_F(Export, OfARasterIsWhatBuildMakesOfSuchAName) {
  for (const std::string name : {"a.pmtiles", "a.3tz", "a.stl"}) {
    const Ended built = shell(build("-o " + place(name) + " --max-level 8"));
    ASSERT_EQ(built.code, 0) << built.output;
    EXPECT_THAT(built.output, HasSubstr("written to " + place(name)));
    ASSERT_EQ(exported("-o " + place("by_" + name)).code, 0);
    EXPECT_EQ(file_text(place(name)), file_text(place("by_" + name))) << name;
  }
  ASSERT_EQ(shell(build("-o " + place("drc.pmtiles") + " -q --max-level 8 --formats drc")).code, 0);
  ASSERT_EQ(exported("-o " + place("by_drc.pmtiles") + " --format drc").code, 0);
  EXPECT_EQ(file_text(place("drc.pmtiles")), file_text(place("by_drc.pmtiles")));
  const Ended of_mesh = shell(build("-o " + place("b.glb") + " -q --max-level 8 --formats drc"));
  EXPECT_EQ(of_mesh.code, 2);
  const Ended of_store = shell(build("-o " + place("b.sqlite") + " -q --max-level 8 --formats terrain-rgb"));
  EXPECT_EQ(of_store.code, 2);
  EXPECT_THAT(of_store.output, HasSubstr("--formats is for a folder or an archive"));
  for (const char* name : {"b.glb", "b.sqlite"}) EXPECT_FALSE(std::filesystem::exists(place(name))) << name;
  const Ended again = shell(build("-o " + place("a.3tz") + " -q"));
  EXPECT_EQ(again.code, 1);
  EXPECT_THAT(again.output, HasSubstr("--overwrite"));
  const Ended wrong = shell(build("-o " + place("b.3tz") + " --formats drc"));
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.output, HasSubstr("3d-tiles"));
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
    EXPECT_NE(entry.path().extension(), ".building") << entry.path();
}

TEST_F(Export, AFileThatBuildDoesNotWriteIsNoFoldersName) {
  for (const char* name : {"out.zip", "OUT.TIF"}) {
    const Ended refused = shell(build("-o " + place(name) + " -q"));
    EXPECT_EQ(refused.code, 2) << name;
    EXPECT_THAT(refused.output, HasSubstr("build writes no such file as " + place(name)));
    EXPECT_FALSE(std::filesystem::exists(place(name)));
  }
  EXPECT_EQ(shell(build("-o " + place("out.tif/") + " -q --max-level 6")).code, 0);
  EXPECT_EQ(shell(build("-o " + place("out.tif") + " -q --max-level 6 --overwrite")).code, 0) << "it is a folder by now";
}

TEST_F(Export, APartOfADatasetAsAMesh) {
  ASSERT_EQ(exported("-o " + place("box.ply") + " --level 8 --bbox 10.1,46.1,10.3,46.4 --frame geodetic").code, 0);
  const auto box = proto::read_mesh_file(place("box.ply"));
  ASSERT_TRUE(box.ok()) << box.problem().line();
  EXPECT_NEAR(*std::min_element(box->mesh.x.begin(), box->mesh.x.end()), 10.1, 1e-9);
  EXPECT_NEAR(*std::max_element(box->mesh.y.begin(), box->mesh.y.end()), 46.4, 1e-9);
  ASSERT_EQ(exported("-o " + place("map.ply") + " --level 8 --bbox 10.1,46.1,10.3,46.4 --frame 32632").code, 0);
  const auto map = proto::read_mesh_file(place("map.ply"));
  ASSERT_TRUE(map.ok()) << map.problem().line();
  EXPECT_NEAR(*std::min_element(map->mesh.x.begin(), map->mesh.x.end()), 584600, 1000);
  EXPECT_NEAR(*std::max_element(map->mesh.y.begin(), map->mesh.y.end()), 5139500, 1000);
  const Ended degrees = exported("-o " + place("crs.ply") + " --frame crs");
  EXPECT_EQ(degrees.code, 1);
  EXPECT_THAT(degrees.output,
              HasSubstr("the raster's own CRS: WGS 84 (EPSG:4326) is in degrees; accepted: the code of a projected CRS"));
}

TEST_F(Export, RefusalsNameWhatIsAccepted) {
  EXPECT_THAT(exported("-o " + place("a.zip")).output, HasSubstr(".pmtiles"));
  EXPECT_THAT(exported("-o " + place("a.3tz") + " --format drc").output, HasSubstr("3d-tiles"));
  EXPECT_THAT(exported("-o " + place("a.pmtiles") + " --level 3").output, HasSubstr("--level is for meshes"));
  EXPECT_THAT(exported("-o " + place("a.glb") + " --level 8 --max-triangles 3").output, HasSubstr("3 triangles"));
  EXPECT_THAT(exported("-o " + place("a.glb") + " --levle 3").output, HasSubstr("did you mean --level?"));
  for (const char* level : {"30", "9"})
    EXPECT_THAT(exported("-o " + place("a.glb") + " --level " + level).output,
                HasSubstr("the dataset has no level " + std::string(level) + "; accepted: levels 0 to 8"));
  EXPECT_THAT(exported("-o " + place("a.glb") + " --level x").output, HasSubstr("--level='x'"));
  EXPECT_THAT(exported("-o " + place("a.glb") + " --bbox 46.1,10.1,46.3,10.4").output,
              HasSubstr("; in the order west,south,east,north it would: 10.1,46.1,10.4,46.3"));
  EXPECT_THAT(exported("-o " + place("a.glb") + " --bbox 80,10,81,11").output, HasSubstr("the bbox does not touch the dataset;"));
  EXPECT_THAT(shell(kProgram + " export " + raster_ + " -o " + place("a.glb")).output, HasSubstr("cone.asc"));
  EXPECT_THAT(exported("-o " + place("a.3tz") + " --threads many").output, HasSubstr("0 to 1024"));
  EXPECT_THAT(exported("-o " + place("a.glb") + " --threads 2").output, HasSubstr("--threads is for archives"));
  EXPECT_EQ(exported("").code, 2);
  EXPECT_EQ(exported("-o " + place("a.stl") + " --frame ecef").code, 2);
  for (const char* name : {"a.3tz", "a.pmtiles", "a.glb", "a.stl"}) EXPECT_FALSE(std::filesystem::exists(place(name))) << name;
}

TEST_F(Export, NormalMapsOf3dTiles) {
  ASSERT_EQ(exported("-o " + place("plain.3tz") + " --threads 3").code, 0);
  ASSERT_EQ(exported("-o " + place("lit.3tz") + " --normals texture").code, 0);
  EXPECT_THAT(file_text(place("plain.3tz")), Not(HasSubstr("EXT_texture_webp")));
  EXPECT_THAT(file_text(place("lit.3tz")), HasSubstr("EXT_texture_webp"));
  EXPECT_THAT(exported("-o " + place("a.3tz") + " --normals shiny").output, HasSubstr("accepted: vertex"));
  EXPECT_THAT(exported("-o " + place("a.pmtiles") + " --normals texture").output, HasSubstr(".3tz"));
  EXPECT_THAT(exported("-o " + place("a.glb") + " --normals texture").output, HasSubstr(".3tz"));

  const Ended built = shell(build("-o " + place("out") + " -q --max-level 8 --normals texture"));
  ASSERT_EQ(built.code, 0) << built.output;
  EXPECT_THAT(file_text(place("out/tileset.json")), Not(HasSubstr("normals="))) << "a folder has one kind of tiles";
  EXPECT_THAT(file_text(place("out/tiles/E/0/0/0.glb")), HasSubstr("EXT_texture_webp"));
  EXPECT_EQ(shell(build("-o " + place("b") + " -q --max-level 8 --normals shiny")).code, 2);

  const std::string publish = kProgram + " publish " + place("plan") + " -q --normals texture -o ";
  const Ended published = shell(kProgram + " plan " + raster_ + " --crs EPSG:4326 -q --max-level 8 -o " + place("plan") + " && " +
                                kProgram + " work " + place("plan") + " -q && " + publish + place("published"));
  ASSERT_EQ(published.code, 0) << published.output;
  EXPECT_THAT(file_text(place("published/tiles/E/0/0/0.glb")), HasSubstr("EXT_texture_webp"));
  EXPECT_EQ(shell(publish + place("p.sqlite")).code, 2);
  EXPECT_EQ(shell(build("-o " + place("b.sqlite") + " -q --max-level 8 --normals none")).code, 2);
}

TEST_F(Export, ContoursAtAnInterval) {
  const auto lines = [&](const std::string& folder, const std::string& words) {
    const Ended built = shell(build("-o " + place(folder) + " -q --max-level 8 --formats contours " + words));
    EXPECT_EQ(built.code, 0) << built.output;
    std::string tiles;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(place(folder + "/contours")))
      if (entry.is_regular_file()) tiles += file_text(entry.path());
    return tiles;
  };
  const std::string usual = lines("usual", ""), chosen = lines("chosen", "--interval 125.5");
  EXPECT_NE(usual, chosen);
  EXPECT_EQ(Json::parse(file_text(place("chosen/contours.json")))["zooms"].back()["interval"], 125.5);
  EXPECT_EQ(
      lines("same", "--interval " + Json::parse(file_text(place("usual/contours.json")))["zooms"].back()["interval"].dump()),
      usual);
  const std::string archive = "-o " + place("a.mbtiles") + " --overwrite --format contours";
  ASSERT_EQ(exported(archive).code, 0);
  const std::string before = file_text(place("a.mbtiles"));
  ASSERT_EQ(exported(archive + " --interval 125.5").code, 0);
  EXPECT_NE(file_text(place("a.mbtiles")), before);
  for (const auto& [words, said] :
       {std::pair{"-o " + place("b.mbtiles") + " --interval 125", "--interval is for contours: "},
        {"-o " + place("b.glb") + " --interval 125", "is to be a mesh"},
        {archive + " --interval 0.5", "--interval: '0.5' is no interval of contours; accepted: metres, 1 to 5000"}}) {
    const Ended refused = exported(words);
    EXPECT_EQ(refused.code, 2) << words;
    EXPECT_THAT(refused.output, HasSubstr(said)) << words;
  }
  EXPECT_THAT(shell(build("-o " + place("b") + " -q --interval 125")).output,
              HasSubstr("--interval is for contours, which --formats leaves out"));
}

TEST_F(Export, AnOrthophotoOn3dTiles) {
  const std::string photo = write_photo("photo", "5"), away = write_photo("away", "40");
  const std::string lossy =
      exported("-o " + place("shown.3tz") + " --texture " + photo + " --texture-size 512 --texture-quality 60").output;
  EXPECT_THAT(file_text(place("shown.3tz")), AllOf(HasSubstr("baseColorTexture"), HasSubstr("KHR_texture_transform"))) << lossy;
  for (const auto& [words, said] : {std::pair{"--texture " + away, "shows no part of the terrain"},
                                    {"--texture " + raster_, "red, green and blue"},
                                    {"--texture " + place("none.tif"), "none.tif does not exist"},
                                    {"--texture-size 512", "--texture-size: it is of an orthophoto"},
                                    {"--texture " + photo + " --texture-size 300", "512, 1024 or 2048"},
                                    {"--texture " + photo + " --texture-quality 0", "a whole number from 1 to 100"}}) {
    const Ended refused = exported("-o " + place("a.3tz") + " " + words);
    EXPECT_NE(refused.code, 0) << words;
    EXPECT_THAT(refused.output, HasSubstr(said)) << words;
  }
  EXPECT_THAT(exported("-o " + place("a.pmtiles") + " --texture " + photo).output, HasSubstr("--texture is for 3D Tiles"));

  const Ended built = shell(build("-o " + place("painted") + " -q --max-level 8 --texture " + photo));
  ASSERT_EQ(built.code, 0) << built.output;
  EXPECT_THAT(file_text(place("painted/tiles/E/0/0/0.glb")), HasSubstr("baseColorTexture"));
  EXPECT_THAT(file_text(place("painted/index.html")), HasSubstr("const photo = true;")) << "no colours by height over it";
  const Ended elsewhere = shell(build("-o " + place("b") + " -q --max-level 8 --texture " + away));
  EXPECT_THAT(elsewhere.output, HasSubstr("shows no part of the terrain")) << "before the build";
  EXPECT_EQ(shell(build("-o " + place("b.sqlite") + " -q --max-level 8 --texture " + photo)).code, 2);
}

TEST_F(Export, TheServerGivesWhatNormalsAsksFor) {
  start_server();
  const std::string base = server_.base() + "/v1/datasets/" +
                           std::string(curl("-X POST -H 'Prefer: wait=400' " + post_arguments("&max_level=8"))["id"]);
  const auto got = [&](const std::string& path, const std::string& more = "") {
    return shell("curl -q -s -i " + more + " '" + base + path + "'").output;
  };
  const std::string tile = "/tiles/0/1/0.glb";
  EXPECT_THAT(got("/tileset.json?normals=texture"), HasSubstr("tiles/E/{level}/{x}/{y}.glb?normals=texture"));
  EXPECT_THAT(got(tile + "?normals=texture"), HasSubstr("EXT_texture_webp"));
  EXPECT_THAT(got("/tiles/E/0/0/0.glb?normals=texture"), HasSubstr("EXT_texture_webp"));
  EXPECT_THAT(got(tile), AllOf(HasSubstr("NORMAL"), Not(HasSubstr("EXT_texture_webp"))));
  EXPECT_THAT(got(tile + "?normals=none"), AllOf(HasSubstr("200 OK"), Not(HasSubstr("NORMAL"))));
  for (const char* path : {"/tileset.json", "/tiles/0/1/0.glb", "/tileset-explicit.json"}) {
    EXPECT_THAT(got(std::string(path) + "?normals=shiny"),
                AllOf(HasSubstr("400 Bad Request"), HasSubstr("option-invalid"), HasSubstr("texture (a normal map")))
        << path;
  }
  EXPECT_THAT(got("/subtrees/E/0/0/0.subtree?normals=texture"), HasSubstr("200 OK")) << "CesiumJS hands the query on";
  const auto tag = [&](const std::string& path) {
    const std::string answer = got(path);
    const std::size_t at = answer.find("ETag: ");
    return answer.substr(at + 6, answer.find('\r', at) - at - 6);
  };
  const std::string lit = tag(tile + "?normals=texture");
  EXPECT_NE(lit, tag(tile));
  EXPECT_THAT(got(tile + "?normals=texture", "-H 'If-None-Match: " + lit + "'"), HasSubstr("304 Not Modified"));
  EXPECT_THAT(got(tile, "-H 'If-None-Match: " + lit + "'"), HasSubstr("200 OK"));
}

TEST_F(Export, TheServerGivesTheSameMesh) {
  start_server();
  const std::string id = curl("-X POST -H 'Prefer: wait=400' " + post_arguments("&max_level=8"))["id"];
  const std::string base = server_.base() + "/v1/datasets/" + id;
  for (const std::string& name :
       {std::string("mesh.glb"), std::string("mesh.ply"), std::string("mesh.obj"), std::string("mesh.stl")}) {
    const Ended got = shell("curl -q -sf -o " + place("http") + " '" + base + "/" + name + "?level=7&bbox=10.1,46.1,10.3,46.4'");
    ASSERT_EQ(got.code, 0) << name;
    ASSERT_EQ(exported("-o " + place(name) + " --level 7 --bbox 10.1,46.1,10.3,46.4").code, 0);
    EXPECT_TRUE(file_text(place("http")) == file_text(place(name))) << name;
  }
  const std::string head = shell("curl -q -sI '" + base + "/mesh.glb?level=6'").output;
  EXPECT_THAT(head, HasSubstr("200 OK"));
  EXPECT_THAT(head, HasSubstr("model/gltf-binary"));
  EXPECT_THAT(head, HasSubstr("filename=\"" + id + "-6.glb\""));
  EXPECT_THAT(shell("curl -q -sI '" + base + "/tiles/8/270/193.drc'").output, HasSubstr("Server-Timing: make;dur="));
  EXPECT_THAT(shell("curl -q -s -D - -o /dev/null -H 'If-None-Match: *' '" + base + "/mesh.glb?level=6'").output,
              HasSubstr("304"));
}

/// Archives are told by what they say of themselves.
TEST_F(Export, InfoOfAnArchiveSaysWhatItHolds) {
  for (const std::string name : {"a.pmtiles", "a.mbtiles"}) {
    ASSERT_EQ(exported("-o " + place(name) + " --format terrarium -q").code, 0);
    const Ended told = shell(kProgram + " info " + place(name));
    EXPECT_EQ(told.code, 0) << told.output;
    EXPECT_THAT(told.output, testing::AllOf(HasSubstr("name      cone.asc"), HasSubstr("holds     terrarium"),
                                            HasSubstr("zooms     0 to "), HasSubstr("heights as terrarium")));
    const Json json = Json::parse(shell(kProgram + " info --json " + place(name)).output, nullptr, false);
    EXPECT_EQ(json["face"], "terrarium") << name;
    EXPECT_EQ(json["zooms"][0], (Json{{"zoom", 0}, {"tiles", 1}})) << name;
    EXPECT_GT(json["tiles"], 5) << name;
  }
  std::ofstream(place("bad.pmtiles")) << "PMTiles\3 and no more";
  const Ended bad = shell(kProgram + " info " + place("bad.pmtiles"));
  EXPECT_EQ(bad.code, 1);
  EXPECT_THAT(bad.output, HasSubstr("cannot be read: it is cut short"));
}

TEST_F(Export, DecodeSaysThatThereIsNoFile) {
  const Ended none = shell(kProgram + " decode " + place("nofile.drc"));
  EXPECT_EQ(none.code, 1);
  EXPECT_THAT(none.output, HasSubstr("there is no " + place("nofile.drc")));
}

}  // namespace
}  // namespace cordillera::server
