// Written files: what is read back is the same, and a file is there whole or not at all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "mesh_file_samples.h"

namespace cordillera::proto {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr MeshFormat kFormats[] = {MeshFormat::off, MeshFormat::ply_ascii, MeshFormat::ply_little_endian,
                                   MeshFormat::ply_big_endian, MeshFormat::obj};

/// Any bits that are a finite number.
TriangleMesh random_mesh(unsigned seed) {
  std::mt19937_64 random(seed);
  const auto finite = [&] {
    for (;;) {
      const double value = std::bit_cast<double>(random());
      if (std::isfinite(value)) return value;
    }
  };
  TriangleMesh mesh;
  for (int v = 0; v < 200; ++v) {
    for (auto* axis : {&mesh.x, &mesh.y, &mesh.z}) axis->push_back(finite());
  }
  mesh.z[0] = std::numeric_limits<double>::denorm_min();
  mesh.z[1] = std::numeric_limits<double>::max();
  for (int t = 0; t < 300; ++t) {
    const auto corner = [&] { return static_cast<std::uint32_t>(random() % 200); };
    mesh.triangles.push_back({corner(), corner(), corner()});
  }
  return mesh;
}

TEST(WrittenMesh, DoublesComeBackBitForBit) {
  for (const MeshFormat format : kFormats) {
    for (const TriangleMesh& mesh : {roof(), random_mesh(1), random_mesh(2)}) {
      const std::string text = written(mesh, {format, CoordinateType::float64});
      const auto read = read_text(text, "a.obj");
      ASSERT_TRUE(read.ok()) << read.problem().line();
      EXPECT_TRUE(same(read->mesh, mesh)) << name_of(format);
      EXPECT_EQ(read->encoding.format, format);
      EXPECT_EQ(read->encoding.coordinates, CoordinateType::float64);
      EXPECT_EQ(written(read->mesh, read->encoding), text) << "and the same file again";
    }
  }
}

TEST(WrittenMesh, FloatsComeBackAsTheyWereWritten) {
  TriangleMesh mesh = roof();
  mesh.z[3] = 0.1;
  for (const MeshFormat format : {MeshFormat::ply_ascii, MeshFormat::ply_little_endian, MeshFormat::ply_big_endian}) {
    const MeshEncoding floats{format, CoordinateType::float32};
    const std::string text = written(mesh, floats);
    EXPECT_THAT(text, HasSubstr("property float x"));
    const auto read = read_text(text);
    ASSERT_TRUE(read.ok()) << read.problem().line();
    EXPECT_TRUE(same(read->mesh, as_written(mesh, floats))) << name_of(format);
    EXPECT_FALSE(same(read->mesh, mesh));
    EXPECT_EQ(read->encoding.coordinates, CoordinateType::float32);
    EXPECT_EQ(written(read->mesh, read->encoding), text) << "and the same file again";
  }
}

TEST(WrittenMesh, TextHasTheFewestDigits) {
  EXPECT_THAT(written(roof(), {MeshFormat::off, CoordinateType::float64}), HasSubstr("\n0.1 0.3333333333333333 1e+22\n"));
  EXPECT_THAT(written(roof(), {MeshFormat::ply_ascii, CoordinateType::float32}), HasSubstr("\n0.1 0.33333334 1e+22\n"));
}

TEST(WrittenMesh, IsWhatOthersRead) {
  TriangleMesh mesh;
  mesh.x = {0, 1, 0};
  mesh.y = {0, 0, 1};
  mesh.z = {0, 0, 5};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_EQ(written(mesh, {MeshFormat::off, CoordinateType::float64}), kOff);
  EXPECT_EQ(written(mesh, {MeshFormat::obj, CoordinateType::float64}), kObj);
  EXPECT_EQ(written(mesh, {MeshFormat::ply_ascii, CoordinateType::float32}), kPly);
}

TEST(WrittenMesh, ItsNameSaysTheFormatAndItsSourceTheRest) {
  const MeshEncoding big{MeshFormat::ply_big_endian, CoordinateType::float32};
  EXPECT_EQ(encoding_for("a.ply", big)->format, MeshFormat::ply_big_endian);
  EXPECT_EQ(encoding_for("a.ply", big)->coordinates, CoordinateType::float32);
  EXPECT_EQ(encoding_for("a.off", big)->coordinates, CoordinateType::float64);
  EXPECT_EQ(encoding_for("a.PLY", {MeshFormat::obj, CoordinateType::float64})->format, MeshFormat::ply_little_endian);
  EXPECT_EQ(encoding_for("a.b/c.Obj", big)->format, MeshFormat::obj);
  const auto unknown = encoding_for("a.stl", big);
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.problem().parameter, "--output");
}

class MeshFileOnDisk : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "cordillera-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  fs::path folder_;
};

TEST_F(MeshFileOnDisk, ReplacesAnEarlierOneAndLeavesNothingElse) {
  const std::string path = (folder_ / "a.ply").string();
  std::ofstream(path) << "earlier";
  ASSERT_TRUE(write_mesh_file(path, roof(), {}).ok());
  const auto read = read_mesh_file(path);
  ASSERT_TRUE(read.ok()) << read.problem().line();
  EXPECT_TRUE(same(read->mesh, roof()));
  EXPECT_EQ(files(), 1u);
}

TEST_F(MeshFileOnDisk, WritesThroughALink) {
  fs::create_directory(folder_ / "there");
  std::ofstream(folder_ / "there" / "b.ply") << "earlier";
  fs::create_symlink(folder_ / "there" / "b.ply", folder_ / "a.ply");
  ASSERT_TRUE(write_mesh_file((folder_ / "a.ply").string(), roof(), {}).ok());
  EXPECT_TRUE(fs::is_symlink(folder_ / "a.ply"));
  EXPECT_TRUE(read_mesh_file((folder_ / "there" / "b.ply").string()).ok());
}

TEST_F(MeshFileOnDisk, WhatCannotBeWrittenIsSaid) {
  const auto nowhere = write_mesh_file((folder_ / "no" / "a.ply").string(), roof(), {});
  ASSERT_FALSE(nowhere.ok());
  EXPECT_EQ(nowhere.problem().type, "output-failed");
  fs::create_directory(folder_ / "a.ply");
  EXPECT_FALSE(write_mesh_file((folder_ / "a.ply").string(), roof(), {}).ok()) << "a folder";
  EXPECT_FALSE(write_mesh_file("/dev/full", roof(), {}).ok()) << "no file to replace";
  EXPECT_EQ(files(), 1u) << "nothing half-made";
}

TEST_F(MeshFileOnDisk, ADiskThatIsFullLeavesTheEarlierOne) {
  const std::string path = (folder_ / "a.ply").string();
  std::ofstream(path) << "earlier";
  // Files of this process may not grow beyond 1000 bytes: writing fails midway.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  const auto written = write_mesh_file(path, random_mesh(1), {});
  const auto first = write_mesh_file((folder_ / "b.ply").string(), random_mesh(1), {});
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, handler);
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.problem().type, "output-failed");
  EXPECT_EQ(fs::file_size(path), 7u) << "the earlier one";
  ASSERT_FALSE(first.ok());
  for (const Problem& problem : {written.problem(), first.problem()})
    EXPECT_TRUE(problem.detail.ends_with("no room, or the disk failed")) << problem.detail;
  EXPECT_EQ(files(), 1u) << "nothing half-made";
}

TEST_F(MeshFileOnDisk, AStreamThatFailsIsNoticed) {
  std::ofstream full("/dev/full");
  if (!full) GTEST_SKIP() << "no /dev/full here";
  EXPECT_FALSE(write_mesh(full, roof(), {}));
}

TEST_F(MeshFileOnDisk, AStreamThatThrowsWhereItFailsEndsNoProgram) {
  std::ofstream full("/dev/full");
  if (!full) GTEST_SKIP() << "no /dev/full here";
  full.exceptions(std::ios::badbit | std::ios::failbit);
  for (const MeshFormat format : {MeshFormat::off, MeshFormat::obj, MeshFormat::ply_little_endian}) {
    MeshEncoding encoding;
    encoding.format = format;
    EXPECT_THROW(write_mesh(full, random_mesh(1), encoding), std::ios_base::failure);
    full.clear();
  }
  full.exceptions(std::ios::goodbit);
}

}  // namespace
}  // namespace cordillera::proto
