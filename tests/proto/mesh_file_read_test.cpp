// What OFF, PLY and OBJ files of other programs may hold beside the mesh.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mesh_file_samples.h"

namespace cordillera::proto {
namespace {

using testing::ElementsAre;
using Triangle = std::array<std::uint32_t, 3>;

TriangleMesh corner() {
  TriangleMesh mesh;
  mesh.x = {0, 1, 0};
  mesh.y = {0, 0, 1};
  mesh.z = {0, 0, 5};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

void expect_corner(const std::string& text, MeshFormat format, const std::string& name = "in") {
  const auto read = read_text(text, name);
  ASSERT_TRUE(read.ok()) << read.problem().line() << "\n" << text;
  EXPECT_TRUE(same(read->mesh, corner())) << text;
  EXPECT_EQ(read->encoding.format, format) << text;
}

TEST(Off, CommentsBlankLinesAndCarriageReturnsSayNothing) {
  expect_corner(kOff, MeshFormat::off);
  expect_corner("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 5\n3 0 1 2", MeshFormat::off);
  expect_corner(
      "OFF # hill\r\n# made by hand\r\n\r\n3 1 3\r\n0 0 0\r\n\t1 0 0 # east\r\n\r\n0 1 +5\r\n3 0 1 2\r\n# the end\r\n\r\n",
      MeshFormat::off);
  expect_corner("# begins with a comment\n" + kOff, MeshFormat::off, "hill.OFF");
}

TEST(Off, ColoursAndNormalsAreSkipped) {
  expect_corner("COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 5 0 0 255 255\n3 0 1 2 0.5 0.5 0.5\n", MeshFormat::off);
  expect_corner("CNOFF\n3 1 0\n0 0 0 0 0 1 1 0 0\n1 0 0 0 0 1 1 0 0\n0 1 5 0 0 1 1 0 0\n3 0 1 2 7\n", MeshFormat::off);
}

TEST(Obj, EverythingButVerticesAndTrianglesIsSkipped) {
  expect_corner(kObj, MeshFormat::obj, "a.obj");
  expect_corner(
      "# a\nmtllib a.mtl\no hill\ng all of it\nv 0 0 0 1\nv 1 0 0\nv 0 1 5 0.1 0.2 0.3\nvt 0 0\nvn 0 0 1\ns off\nusemtl rock\n"
      "f 1/1/1 2/1/1 3/1/1\nl 1 2\np 3\n",
      MeshFormat::obj, "a.obj");
  expect_corner("v 0 0 0\nv 1 0 0\nv 0 1 5\nf -3//1 -2//1 -1//1", MeshFormat::obj, "a.OBJ");
  expect_corner("f 1 2 \\\r\n 3\nv 0 0 0\nv 1 0 0\nv 0 \\\n1 5\n", MeshFormat::obj, "a.obj");
}

TEST(Ply, AsciiWithComments) {
  expect_corner(kPly, MeshFormat::ply_ascii);
  std::string crlf;
  for (const char c : kPly) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expect_corner(crlf, MeshFormat::ply_ascii);
  expect_corner("ply\nformat ascii 1.0\ncomment property double w\nobj_info by hand\n" + kPly.substr(kPly.find("element")),
                MeshFormat::ply_ascii);
}

TEST(Ply, AsciiWithColoursNormalsEdgesAndListsThatNobodyKnows) {
  expect_corner(
      "ply\nformat ascii 1.0\nelement material 2\nproperty list uchar float shades\nelement vertex 3\nproperty uchar red\n"
      "property double z\nproperty list uint8 int16 neighbours\nproperty float64 x\nproperty float nx\nproperty short y\n"
      "element edge 2\nproperty int vertex1\nproperty int vertex2\nelement face 1\nproperty uchar red\n"
      "property list uint8 uint32 vertex_index\nproperty list uchar float texcoord\nelement nothing 7\nelement last 1\nproperty "
      "char c\n"
      "end_header\n2 0.5 0.25\n0\n255 0 2 7 8 0 nan 0\n0 0 0 1 0.5 0\n9 5 1 3 0 0.5 1\n0 1\n1 2\n17 3 0 1 2 6 0 0 1 0 0 1\n-1\n",
      MeshFormat::ply_ascii);
}

TEST(Ply, FacesMayComeFirst) {
  expect_corner(
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n3 0 1 2\n0 0 0\n1 0 0\n0 1 5\n",
      MeshFormat::ply_ascii);
}

class BinaryPly : public testing::TestWithParam<std::endian> {
 protected:
  bool big() const { return GetParam() == std::endian::big; }
  MeshFormat format() const { return big() ? MeshFormat::ply_big_endian : MeshFormat::ply_little_endian; }
  std::string begin() const { return std::string("ply\nformat binary_") + (big() ? "big" : "little") + "_endian 1.0\n"; }
};

TEST_P(BinaryPly, EveryTypeOfNumber) {
  const std::string header = begin() +
                             "element vertex 3\nproperty short x\nproperty list ushort double weights\nproperty uchar red\n"
                             "property uint y\nproperty double z\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n"
                             "element face 1\nproperty float area\nproperty list char ushort vertex_indices\nend_header\n";
  Bytes bytes(GetParam());
  const auto add = [&](std::int16_t x, std::uint32_t y, double z) {
    bytes.add(x).add(std::uint16_t{2}).add(0.5).add(0.25).add(std::uint8_t{200}).add(y).add(z);
  };
  add(0, 0, 0);
  add(1, 0, 0);
  add(0, 1, 5);
  bytes.add(std::int32_t{0}).add(std::int32_t{1});
  bytes.add(1.5f).add(std::int8_t{3}).add(std::uint16_t{0}).add(std::uint16_t{1}).add(std::uint16_t{2});
  expect_corner(header + bytes.text(), format());
}

TEST_P(BinaryPly, FirstBytesMayLookLikeTheEndOfALine) {
  Bytes bytes(GetParam());
  bytes.add(std::uint8_t{10}).add(std::uint8_t{13}).add(std::uint8_t{10});
  const auto read = read_text(begin() +
                              "element vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z\nelement face 0\n"
                              "property list uchar int vertex_indices\nend_header\n" +
                              bytes.text());
  ASSERT_TRUE(read.ok()) << read.problem().line();
  EXPECT_THAT(read->mesh.x, ElementsAre(10));
  EXPECT_THAT(read->mesh.y, ElementsAre(13));
}

INSTANTIATE_TEST_SUITE_P(Order, BinaryPly, testing::Values(std::endian::little, std::endian::big),
                         [](const auto& order) { return order.param == std::endian::big ? "big" : "little"; });

TEST(Ply, SaysHowItStoresCoordinates) {
  EXPECT_EQ(read_text(kPly)->encoding.coordinates, CoordinateType::float32);
  std::string mixed = kPly;
  mixed.replace(mixed.find("float y"), 7, "double y");
  EXPECT_EQ(read_text(mixed)->encoding.coordinates, CoordinateType::float64) << "floats do not hold y";
  EXPECT_EQ(read_text(kOff)->encoding.coordinates, CoordinateType::float64);
}

TEST(Ply, TextOfAFloatIsTheNearestFloat) {
  std::string text = kPly;
  text.replace(text.find("0 1 5"), 5, "0 1 0.1");
  EXPECT_EQ(read_text(text)->mesh.z[2], static_cast<double>(0.1f));
}

TEST(MeshFile, APipeIsReadToo) {
  // A stream that cannot seek.
  struct Pipe : std::stringbuf {
    using std::stringbuf::stringbuf;
    pos_type seekoff(off_type, std::ios::seekdir, std::ios::openmode) override { return pos_type(off_type(-1)); }
  } pipe(kPly);
  std::istream in(&pipe);
  const auto read = read_mesh(in, "-");
  ASSERT_TRUE(read.ok()) << read.problem().line();
  EXPECT_TRUE(same(read->mesh, corner()));
}

TEST(MeshFile, LargerThanOneBuffer) {
  TriangleMesh mesh;
  for (int k = 0; k < 30000; ++k) {
    mesh.x.push_back(k * 0.1);
    mesh.y.push_back(k / 3.0);
    mesh.z.push_back(-k);
    if (k > 1) {
      mesh.triangles.push_back(
          {static_cast<std::uint32_t>(k - 2), static_cast<std::uint32_t>(k - 1), static_cast<std::uint32_t>(k)});
    }
  }
  for (const MeshFormat format :
       {MeshFormat::off, MeshFormat::ply_ascii, MeshFormat::ply_little_endian, MeshFormat::ply_big_endian, MeshFormat::obj}) {
    const auto read = read_text(written(mesh, {format, CoordinateType::float64}), "a.obj");
    ASSERT_TRUE(read.ok()) << read.problem().line();
    EXPECT_TRUE(same(read->mesh, mesh)) << name_of(format);
  }
}

}  // namespace
}  // namespace cordillera::proto
