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
}

TEST_F(Export, APartOfADatasetAsAMesh) {
  ASSERT_EQ(exported("-o " + place("box.ply") + " --level 8 --bbox 10.1,46.1,10.3,46.4 --frame geodetic").code, 0);
  const auto box = proto::read_mesh_file(place("box.ply"));
  ASSERT_TRUE(box.ok()) << box.problem().line();
  EXPECT_NEAR(*std::min_element(box->mesh.x.begin(), box->mesh.x.end()), 10.1, 1e-9);
  EXPECT_NEAR(*std::max_element(box->mesh.y.begin(), box->mesh.y.end()), 46.4, 1e-9);
}

TEST_F(Export, RefusalsNameWhatIsAccepted) {
  EXPECT_THAT(exported("-o " + place("a.zip")).output, HasSubstr(".pmtiles"));
  EXPECT_THAT(exported("-o " + place("a.3tz") + " --format drc").output, HasSubstr("3d-tiles"));
  EXPECT_THAT(exported("-o " + place("a.pmtiles") + " --level 3").output, HasSubstr("--level is for meshes"));
  EXPECT_THAT(exported("-o " + place("a.glb") + " --level 8 --max-triangles 3").output, HasSubstr("3 triangles"));
  EXPECT_THAT(exported("-o " + place("a.glb") + " --levle 3").output, HasSubstr("did you mean --level?"));
  EXPECT_THAT(exported("-o " + place("a.glb") + " --level 30").output, HasSubstr("--level='30'"));
  EXPECT_THAT(shell(kProgram + " export " + raster_ + " -o " + place("a.glb")).output, HasSubstr("cone.asc"));
  EXPECT_EQ(exported("").code, 2);
  EXPECT_EQ(exported("-o " + place("a.stl") + " --frame ecef").code, 2);
  for (const char* name : {"a.3tz", "a.pmtiles", "a.glb", "a.stl"}) EXPECT_FALSE(std::filesystem::exists(place(name))) << name;
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

}  // namespace
}  // namespace cordillera::server
