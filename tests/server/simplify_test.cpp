// cordillera simplify as a user runs it: small mesh files in, smaller ones out, and what it will not take.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "gpu/fit/vertical_error.h"
#include "proto/mesh_file/mesh_file.h"
#include "real_server.h"
#include "server/cli/simplify_command.h"

namespace cordillera::server {
namespace {

using proto::CoordinateType;
using proto::MeshFormat;
using proto::TriangleMesh;
using testing::AllOf;
using testing::HasSubstr;

/// Two hills over side x side vertices, 30 m apart, at coordinates as a map projection gives them.
TriangleMesh hills(int side) {
  TriangleMesh mesh;
  for (int r = 0; r < side; ++r) {
    for (int c = 0; c < side; ++c) {
      const double u = 6.0 * c / side, v = 6.0 * r / side;
      mesh.x.push_back(412345.5 + 30 * c);
      mesh.y.push_back(5098765.25 + 30 * r);
      mesh.z.push_back(500 + 90 * std::sin(u) * std::cos(v * 0.7) + 10 * std::sin(3 * u + v));
    }
  }
  const auto at = [side](int c, int r) { return static_cast<std::uint32_t>(r * side + c); };
  for (int r = 0; r + 1 < side; ++r) {
    for (int c = 0; c + 1 < side; ++c) {
      mesh.triangles.push_back({at(c, r), at(c + 1, r), at(c + 1, r + 1)});
      mesh.triangles.push_back({at(c, r), at(c + 1, r + 1), at(c, r + 1)});
    }
  }
  return mesh;
}

class Simplify : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  void write(const std::string& name, const TriangleMesh& mesh, const proto::MeshEncoding& encoding) const {
    ASSERT_TRUE(proto::write_mesh_file(path(name), mesh, encoding).ok());
  }
  Ended run(const std::string& arguments) const {
    return shell("cd " + folder_.path().string() + " && " + kProgram + " simplify --device cpu " + arguments);
  }
  Json report(const std::string& arguments) const {
    const Ended ended = run("--json " + arguments);
    EXPECT_EQ(ended.code, 0) << ended.output;
    return ended.code == 0 ? Json::parse(ended.output) : Json();
  }
  TriangleMesh result(const std::string& name) const {
    auto file = proto::read_mesh_file(path(name));
    EXPECT_TRUE(file.ok()) << (file ? "" : file.problem().line());
    return file ? file->mesh : TriangleMesh();
  }
  /// Refused with these words, exit code 1, and the output's folder as it was.
  void expect_refused(const TriangleMesh& mesh, const std::string& words) const {
    write("bad.off", mesh, {MeshFormat::off, CoordinateType::float64});
    expect_refused("bad.off", words);
  }
  void expect_refused(const std::string& name, const std::string& words) const {
    std::ofstream(path("out.off")) << "earlier";
    const Ended ended = run(name + " -o out.off --keep 0.5");
    EXPECT_EQ(ended.code, 1) << ended.output;
    EXPECT_THAT(ended.output, AllOf(HasSubstr(name), HasSubstr(words)));
    EXPECT_EQ(file_text(path("out.off")), "earlier") << "a failure replaces nothing";
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      EXPECT_EQ(entry.path().string().find(".partial"), std::string::npos) << entry.path();
    }
  }

  TempFolder folder_;
};

TEST_F(Simplify, TellsWhatIsInTheFile) {
  const TriangleMesh input = hills(41);
  write("in.ply", input, {MeshFormat::ply_little_endian, CoordinateType::float64});
  const Json told = report("in.ply -o out.ply --keep 0.1");
  const TriangleMesh output = result("out.ply");
  EXPECT_EQ(told["input_vertices"], 1681);
  EXPECT_EQ(told["input_triangles"], 3200);
  EXPECT_EQ(told["triangles"], 320);
  EXPECT_EQ(told["triangles"], output.triangles.size());
  EXPECT_EQ(told["vertices"], output.vertices());
  const auto error = gpu::vertical_error(output, {input.x, input.y, input.z});
  EXPECT_EQ(told["rmse_m"], error.rmse) << "of the surface as it is in the file";
  EXPECT_EQ(told["max_error_m"], error.max);
  EXPECT_EQ(told["uncovered_vertices"], 0);
  EXPECT_EQ(error.uncovered, 0u);
  EXPECT_GT(error.max, 0);
  EXPECT_LT(error.max, 20) << "a tenth of the triangles is enough for such hills";
  EXPECT_GT(told["simplify_seconds"], 0);
  EXPECT_EQ(told["device"], "cpu");
}

TEST_F(Simplify, ReadsAndWritesEveryFormat) {
  struct Case {
    const char *input, *output;
    proto::MeshEncoding from, to;
  };
  const proto::MeshEncoding off{MeshFormat::off, CoordinateType::float64}, obj{MeshFormat::obj, CoordinateType::float64};
  const proto::MeshEncoding ascii{MeshFormat::ply_ascii, CoordinateType::float64},
      big{MeshFormat::ply_big_endian, CoordinateType::float64};
  const proto::MeshEncoding little{MeshFormat::ply_little_endian, CoordinateType::float64};
  for (const Case& c : {Case{"a.off", "b.ply", off, little},
                        {"a.obj", "b.off", obj, off},
                        {"a.ply", "b.obj", ascii, obj},
                        {"a.ply", "b.ply", big, big},
                        {"a.ply", "b.ply", ascii, ascii}}) {
    write(c.input, hills(11), c.from);
    const Json told = report(std::string(c.input) + " -o " + c.output + " --triangles 60");
    // The border of so small a mesh may not leave a way to exactly 60.
    EXPECT_LE(told["triangles"], 60);
    EXPECT_GE(told["triangles"], 57);
    EXPECT_EQ(told["input_format"], proto::name_of(c.from.format));
    EXPECT_EQ(told["output_format"], proto::name_of(c.to.format));
    const auto file = proto::read_mesh_file(path(c.output));
    ASSERT_TRUE(file.ok());
    EXPECT_EQ(file->encoding.format, c.to.format);
    EXPECT_EQ(file->mesh.triangles.size(), told["triangles"]);
  }
}

/// The mesh with three vertices of its own for each triangle.
TriangleMesh apart(const TriangleMesh& mesh) {
  TriangleMesh apart;
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(apart.vertices());
    for (const std::uint32_t v : triangle) {
      apart.x.push_back(mesh.x[v]);
      apart.y.push_back(mesh.y[v]);
      apart.z.push_back(mesh.z[v]);
    }
    apart.triangles.push_back({first, first + 1, first + 2});
  }
  return apart;
}

TEST_F(Simplify, VerticesAtOnePlaceAreOne) {
  const TriangleMesh input = hills(41);
  write("in.ply", input, {MeshFormat::ply_little_endian, CoordinateType::float64});
  write("apart.ply", apart(input), {MeshFormat::ply_little_endian, CoordinateType::float64});
  EXPECT_EQ(report("in.ply -o out.ply --keep 0.1")["joined_vertices"], 0);
  const Json told = report("apart.ply -o out.ply --keep 0.1");
  EXPECT_EQ(told["input_vertices"], 9600);
  EXPECT_EQ(told["joined_vertices"], 9600 - 1681);
  EXPECT_EQ(told["triangles"], 320);
  EXPECT_EQ(told["uncovered_vertices"], 0);
  const TriangleMesh output = result("out.ply");
  EXPECT_LT(output.vertices(), 200u);
  const TriangleMesh split = apart(input);
  EXPECT_EQ(told["max_error_vertex"], gpu::vertical_error(output, {split.x, split.y, split.z}).worst) << "numbers are the file's";
}

TEST_F(Simplify, PartsThatOnlyTouchStayApart) {
  TriangleMesh mesh = hills(21);
  const TriangleMesh one = mesh;
  const auto last = static_cast<std::uint32_t>(one.vertices());
  for (std::uint32_t v = 0; v < last; ++v) {  // the first vertex of the second part is the last one of the first
    mesh.x.push_back(one.x[v] + one.x.back() - one.x[0]);
    mesh.y.push_back(one.y[v] + one.y.back() - one.y[0]);
    mesh.z.push_back(one.z[v] + one.z.back() - one.z[0]);
  }
  mesh.z[last] = one.z.back();  // rounded otherwise
  for (const auto& t : one.triangles) mesh.triangles.push_back({t[0] + last, t[1] + last, t[2] + last});
  write("two.off", mesh, {MeshFormat::off, CoordinateType::float64});
  const Json told = report("two.off -o out.off --keep 0.2");
  EXPECT_EQ(told["joined_vertices"], 0);
  EXPECT_EQ(told["triangles"], 320);
}

TEST_F(Simplify, FloatsStayFloatsUnlessTheyWouldSpoilIt) {
  TriangleMesh near = hills(21);
  for (double& x : near.x) x -= 412345.5;
  for (double& y : near.y) y -= 5098765.25;
  write("near.ply", near, {MeshFormat::ply_little_endian, CoordinateType::float32});
  EXPECT_EQ(report("near.ply -o out.ply --keep 0.2")["output_coordinates"], "float32");
  EXPECT_EQ(proto::read_mesh_file(path("out.ply"))->encoding.coordinates, CoordinateType::float32);

  // Half a metre apart at five million: floats there are half a metre apart too.
  TriangleMesh far = near;
  for (double& x : far.x) x = 5e6 + x / 60;
  for (double& y : far.y) y = 5e6 + y / 60;
  write("far.ply", far, {MeshFormat::ply_little_endian, CoordinateType::float32});
  const Json told = report("far.ply -o out.ply --keep 0.2");
  EXPECT_EQ(told["output_coordinates"], "float64");
  EXPECT_EQ(proto::read_mesh_file(path("out.ply"))->encoding.coordinates, CoordinateType::float64);
}

TEST_F(Simplify, FloatsDoNotBreakABound) {
  // At a million floats are a sixteenth apart, which is more than the bound.
  TriangleMesh high = hills(41);
  for (std::size_t v = 0; v < high.vertices(); ++v) {
    high.x[v] -= 412345.5;
    high.y[v] -= 5098765.25;
    high.z[v] += 1e6;
  }
  write("high.ply", high, {MeshFormat::ply_little_endian, CoordinateType::float32});
  const Json told = report("high.ply -o out.ply --error 0.04");
  EXPECT_LE(told["max_error_m"], 0.04);
  EXPECT_LT(told["triangles"], 3200);
  EXPECT_EQ(told["output_coordinates"], "float64");
}

TEST_F(Simplify, ABoundInMetresHolds) {
  write("in.off", hills(41), {MeshFormat::off, CoordinateType::float64});
  std::uint64_t before = 3200;
  for (const double metres : {0.5, 2.0, 10.0}) {
    const Json told = report("in.off -o out.off --error " + std::to_string(metres));
    EXPECT_LE(told["max_error_m"], metres);
    EXPECT_LT(told["triangles"], before) << "more room, fewer triangles";
    before = told["triangles"];
  }
}

TEST_F(Simplify, EveryQualityKeepsTheCountAndNoneIsTheSame) {
  write("in.ply", hills(41), {MeshFormat::ply_little_endian, CoordinateType::float64});
  std::map<std::string, double> rmse, most;
  for (const std::string quality : {"fast", "default", "best", "minimax"}) {
    const Json told = report("in.ply -o out.ply --triangles 200 --strategy waves --quality " + quality);
    EXPECT_EQ(told["triangles"], 200) << quality;
    rmse[quality] = told["rmse_m"];
    most[quality] = told["max_error_m"];
  }
  EXPECT_LT(rmse["default"], rmse["fast"]);
  EXPECT_LE(rmse["best"], rmse["default"] * 1.05);
  EXPECT_LT(most["minimax"], most["default"]);
}

/// The border of two notches has twelve corners.
TEST_F(Simplify, MoreTrianglesThanAskedForAreTold) {
  TriangleMesh mesh = hills(13);
  std::erase_if(mesh.triangles, [&](const auto& triangle) {
    const auto column = triangle[0] % 13, row = triangle[0] / 13;
    return (column >= 10 && row <= 1) || (column <= 1 && row >= 10);
  });
  std::vector<std::uint32_t> place(mesh.vertices(), 0);
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle) place[v] = 1;
  TriangleMesh notched;
  for (std::size_t v = 0; v < place.size(); ++v) {
    if (place[v] == 0) continue;
    place[v] = static_cast<std::uint32_t>(notched.vertices());
    notched.x.push_back(mesh.x[v]), notched.y.push_back(mesh.y[v]), notched.z.push_back(mesh.z[v]);
  }
  for (const auto& t : mesh.triangles) notched.triangles.push_back({place[t[0]], place[t[1]], place[t[2]]});
  write("in.ply", notched, {MeshFormat::ply_little_endian, CoordinateType::float64});
  const Ended few = run("in.ply -o out.ply --triangles 3");
  EXPECT_EQ(few.code, 0) << few.output;
  EXPECT_THAT(few.output, HasSubstr("cordillera: warning: " + std::to_string(result("out.ply").triangles.size()) +
                                    " triangles instead of 3: the border stays where it is"));
  EXPECT_THAT(run("in.ply -o out.ply --keep 0.001 --strategy cleap").output,
              HasSubstr("the published algorithm found no further edge to collapse"));
  for (const std::string target : {"--triangles 100", "--triangles 100000", "--error 5", "--strategy cleap --collapses 20"})
    EXPECT_THAT(run("in.ply -o out.ply " + target).output, testing::Not(HasSubstr("warning"))) << target;
}

TEST_F(Simplify, SameBytesWhateverTheThreads) {
  write("in.ply", hills(31), {MeshFormat::ply_little_endian, CoordinateType::float64});
  const Json one = report("in.ply -o one.ply --keep 0.2 --threads 1"),
             three = report("in.ply -o three.ply --keep 0.2 --threads 3");
  EXPECT_EQ(file_text(path("one.ply")), file_text(path("three.ply")));
  EXPECT_EQ(one["rmse_m"], three["rmse_m"]);
}

TEST_F(Simplify, MayReplaceItsOwnInput) {
  write("in.ply", hills(21), {MeshFormat::ply_big_endian, CoordinateType::float64});
  EXPECT_EQ(report("in.ply -o in.ply --triangles 100")["triangles"], 100);
  EXPECT_EQ(result("in.ply").triangles.size(), 100u);
}

TEST_F(Simplify, ThePublishedAlgorithmTellsOfItsWork) {
  write("in.ply", hills(41), {MeshFormat::ply_little_endian, CoordinateType::float64});
  const Json told = report("in.ply -o out.off --strategy cleap --metric length --collapses 300 --window 64 --seed 7 --pool 0.5");
  EXPECT_EQ(told["strategy"], "cleap");
  EXPECT_EQ(told["collapses"], 300);
  EXPECT_EQ(told["triangles"], 3200 - 2 * 300);
  EXPECT_EQ(told["vertices"], 1681 - 300);
  EXPECT_EQ(result("out.off").vertices(), 1681u - 300);
  EXPECT_GE(told["iterations"], (300 + 63) / 64);
  std::uint64_t discards = 0;
  for (const auto& [name, count] : told["discards"].items()) discards += count.get<std::uint64_t>();
  EXPECT_EQ(told["candidates"], 300 + discards);
  EXPECT_NEAR(told["success_percent"], 100.0 * 300 / told["candidates"].get<double>(), 1e-6);
  EXPECT_GE(told["phases"].size(), 6u);

  const std::string same = "in.ply -o same.off --strategy cleap --metric length --collapses 300 --window 64 --seed 7 --pool 0.5";
  EXPECT_EQ(report(same + " --threads 3")["collapses"], 300);
  EXPECT_EQ(file_text(path("same.off")), file_text(path("out.off")));
  EXPECT_EQ(report("in.ply -o one.off --strategy sequential --keep 0.5")["triangles"], 1600);
  const Json few = report("in.ply -o few.off --strategy cleap --triangles 320 --border collapse --delaunay at-end");
  EXPECT_LE(few["triangles"], 320);
  EXPECT_GE(few["triangles"], 319) << "a collapse at the border takes one triangle away, others two";
  EXPECT_THAT(run("in.ply -o out.off --strategy cleap --collapses 100").output,
              AllOf(HasSubstr("collapses 100 in "), HasSubstr("discards "), HasSubstr("lock_down"), HasSubstr("phases ")));
}

TEST_F(Simplify, ThePublishedAlgorithmPromisesNoErrorAndWavesHasNoMetric) {
  write("in.ply", hills(21), {MeshFormat::ply_little_endian, CoordinateType::float64});
  const auto refused = [&](const std::string& arguments, const std::string& words) {
    const Ended ended = run("in.ply -o out.off " + arguments);
    EXPECT_EQ(ended.code, 2) << arguments << ": " << ended.output;
    EXPECT_THAT(ended.output, HasSubstr(words)) << arguments;
  };
  refused("--strategy cleap --error 2", "promise none");
  refused("--strategy cleap", "--collapses N");
  refused("--strategy cleap --keep 0.5 --collapses 3", "several wishes");
  refused("--strategy cleap --collapses 2.5", "not a whole number");
  refused("--strategy cleap --collapses 5 --metric beauty", "qem");
  refused("--strategy cleap --collapses 5 --pool 0", "no edge would be tried");
  refused("--strategy sequential --collapses 5 --window 64", "one edge after the other");
  refused("--keep 0.5 --metric length", "no option of waves");
  refused("--collapses 5", "does not count collapses");
  refused("--strategy magic --keep 0.5", "waves, cleap or sequential");
}

TEST_F(Simplify, ATableForPeople) {
  write("in.obj", hills(21), {MeshFormat::obj, CoordinateType::float64});
  const Ended ended = run("in.obj -o out.off --triangles 200");
  EXPECT_EQ(ended.code, 0) << ended.output;
  EXPECT_THAT(ended.output, AllOf(HasSubstr("input     in.obj: OBJ, 441 vertices, 800 triangles"), HasSubstr(" triangles (2"),
                                  HasSubstr("error     rmse "), HasSubstr(" s on cpu; reading ")));
}

TEST_F(Simplify, WhatIsNoHeightFieldIsRefused) {
  TriangleMesh wall = hills(5);
  wall.x[7] = wall.x[6];
  wall.y[7] = wall.y[6];
  expect_refused(wall, "triangle");
  TriangleMesh turned = hills(5);
  std::swap(turned.triangles[9][0], turned.triangles[9][1]);
  expect_refused(turned, "triangle 9");
  TriangleMesh folded = hills(5);
  folded.x[12] += 200;  // past its neighbours
  expect_refused(folded, "triangle");
  TriangleMesh roofed = hills(5);
  const TriangleMesh other = hills(5);
  for (std::size_t v = 0; v < other.vertices(); ++v) {
    roofed.x.push_back(other.x[v] + 11);
    roofed.y.push_back(other.y[v] + 7);
    roofed.z.push_back(other.z[v] + 500);
  }
  for (auto triangle : other.triangles) {
    for (auto& corner : triangle) corner += 25;
    roofed.triangles.push_back(triangle);
  }
  expect_refused(roofed, "vertex");
}

TEST_F(Simplify, WhatIsNoManifoldIsRefused) {
  TriangleMesh crowded = hills(5);
  crowded.triangles.push_back({0, 1, 12});
  expect_refused(crowded, "");
  TriangleMesh bow;  // two triangles that share a vertex only
  bow.x = {0, 2, 1, 0, 2};
  bow.y = {0, 0, 1, 2, 2};
  bow.z = {0, 0, 0, 0, 0};
  bow.triangles = {{0, 1, 2}, {2, 4, 3}};
  expect_refused(bow, "vertex 2");
}

TEST_F(Simplify, WhatIsNoMeshIsRefusedWithItsPlace) {
  std::ofstream(path("nan.off")) << "OFF\n3 1 0\n0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n";
  expect_refused("nan.off", "line 4: vertex 1 has 'nan'");
  std::ofstream(path("quad.obj")) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
  expect_refused("quad.obj", "line 5: polygon 1 has 4 corners");
  std::ofstream(path("short.ply")) << "ply\nformat ascii 1.0\nelement vertex 3\n";
  expect_refused("short.ply", "the file ends within the header");
  std::ofstream(path("none.off")) << "OFF\n0 0 0\n";
  expect_refused("none.off", "has no triangles");
  std::ofstream(path("mesh.stl")) << "solid";
  expect_refused("mesh.stl", "accepted: PLY, OFF or OBJ");
  expect_refused("missing.ply", "cannot read missing.ply");
}

TEST_F(Simplify, WrongUsageIsExitCodeTwo) {
  write("in.off", hills(5), {MeshFormat::off, CoordinateType::float64});
  const auto expect_usage = [&](const std::string& arguments, const std::string& words) {
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.code, 2) << arguments << "\n" << ended.output;
    EXPECT_THAT(ended.output, HasSubstr(words)) << arguments;
  };
  expect_usage("in.off --keep 0.5", "simplify needs to know where to write");
  expect_usage("in.off -o out.off", "one of --keep SHARE, --triangles N, --error METRES");
  expect_usage("in.off -o out.off --keep 0.5 --error 1", "several wishes");
  expect_usage("in.off -o out.off --keep 0", "nothing would be left");
  expect_usage("in.off -o out.off --keep 1.5", "--keep='1.5'");
  expect_usage("in.off -o out.off --triangles 2.5", "not a whole number");
  expect_usage("in.off -o out.off --triangles many", "--triangles='many'");
  expect_usage("in.off -o out.off --error -1", "--error='-1'");
  expect_usage("in.off -o out.off --keep 0.5 --quality good", "accepted: fast, default, best or minimax");
  expect_usage("in.off -o out.off --keep 0.5 --strategy magic", "accepted: waves");
  expect_usage("in.off -o out.off --keep 0.5 --threads -1", "--threads='-1'");
  EXPECT_EQ(shell(kProgram + " simplify in.off -o out.off --keep 0.5 --device gpu").code, 2);
  EXPECT_FALSE(std::filesystem::exists(path("out.off")));
}

TEST_F(Simplify, AnOutputThatCannotBeIsSaidBeforeTheWork) {
  write("in.off", hills(5), {MeshFormat::off, CoordinateType::float64});
  const Ended stl = run("in.off -o out.stl --keep 0.5");
  EXPECT_EQ(stl.code, 1);
  EXPECT_THAT(stl.output, HasSubstr("accepted: .ply, .off or .obj"));
  const Ended nowhere = run("in.off -o no/out.off --keep 0.5");
  EXPECT_EQ(nowhere.code, 1);
  EXPECT_THAT(nowhere.output, HasSubstr("there is no folder no"));
}

}  // namespace
}  // namespace cordillera::server
