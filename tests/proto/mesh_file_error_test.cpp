// Files that are wrong: each is refused with the place where it is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mesh_file_samples.h"

namespace cordillera::proto {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// text with the first `from` made `to`.
std::string with(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

struct Wrong {
  std::string text;
  std::string says;
  std::string type = "mesh-file-invalid";
};

void expect_refused(const std::vector<Wrong>& files, const std::string& name) {
  for (const Wrong& wrong : files) {
    const auto read = read_text(wrong.text, name);
    ASSERT_FALSE(read.ok()) << wrong.text;
    EXPECT_THAT(read.problem().line(), HasSubstr(wrong.says)) << wrong.text;
    EXPECT_EQ(read.problem().type, wrong.type) << wrong.text;
  }
}

TEST(WrongOff, IsRefusedWithItsLine) {
  const char* kShort = "mesh-file-short";
  expect_refused({{"OFF\n3 1 0\n0 0 0\n1 0 0\n", "in.off, line 5: the file ends within vertex 2 of 3", kShort},
                  {"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 5\n", "line 6: the file ends within polygon 0 of 1", kShort},
                  {"OFF\n", "the file ends within the header", kShort},
                  {"", "the file ends within the header", kShort},
                  {with(kOff, "3 0 1 2", "3 0 1 3"), "line 6: triangle 0 has vertex 3, but there are 3, counted from 0"},
                  {with(kOff, "3 0 1 2", "3 0 -1 2"), "line 6: triangle 0 has vertex -1"},
                  {with(kOff, "3 0 1 2", "3 0 1"), "line 6: polygon 0 has not all of its corners"},
                  {with(kOff, "3 0 1 2", "3 0 1 two"), "line 6: polygon 0 has 'two'"},
                  {with(kOff, "3 0 1 2", "4 0 1 2 0"), "line 6: polygon 0 has 4 corners; accepted: triangles only"},
                  {with(kOff, "3 0 1 2", "2 0 1"), "line 6: polygon 0 has 2 corners"},
                  {with(kOff, "3 0 1 2", "3.5 0 1 2"), "line 6: polygon 0 begins with '3.5'"},
                  {with(kOff, "0 1 5", "0 1 nan"), "line 5: vertex 2 has 'nan'; accepted: a finite number"},
                  {with(kOff, "0 1 5", "0 1 inf"), "line 5: vertex 2 has 'inf'"},
                  {with(kOff, "0 1 5", "0 1 1e999"), "line 5: vertex 2 has '1e999'"},
                  {with(kOff, "0 1 5", "0 1"), "line 5: vertex 2 has no three coordinates"},
                  {with(kOff, "0 1 5", "0 1 0x5"), "line 5: vertex 2 has '0x5'"},
                  {with(kOff, "0 1 5", "0 1 5 red"), "line 5: vertex 2 is followed by 'red'"},
                  {with(kOff, "0 1 5", "0 1 5 1 2 3 4 5 6 7 8 9 10"), "line 5: vertex 2 is followed by too many numbers"},
                  {kOff + "3 0 1 2\n", "line 7: the file goes on after its last polygon"},
                  {kOff + std::string(1, '\0'), "line 7: the file goes on"},
                  {with(kOff, "3 1 0", "3 1"), "line 2: the counts have an end"},
                  {with(kOff, "3 1 0", "3 -1 0"), "line 2: the counts have '-1'"},
                  {with(kOff, "3 1 0", "3 1 0 0"), "line 2: the counts go on with '0'"},
                  {with(kOff, "3 1 0", "5000000000 1 0"), "line 2: 5000000000 vertices are too many"},
                  {with(kOff, "OFF", "OFF BINARY"), "line 1: this is a binary OFF"},
                  {with(kOff, "OFF", "4OFF"), "an OFF file does not begin with '4OFF'"}},
                 "in.off");
}

TEST(WrongObj, IsRefusedWithItsLine) {
  expect_refused(
      {{with(kObj, "f 1 2 3", "f 1 2 4"), "in.obj, line 4: a triangle has vertex 4, but there are 3"},
       {with(kObj, "f 1 2 3", "f 0 1 2"), "line 4: a triangle has vertex 0, with 3 before it; accepted: vertices from 1"},
       {with(kObj, "f 1 2 3", "f -4 1 2"), "line 4: a triangle has vertex -4, with 3 before it"},
       {with(kObj, "f 1 2 3", "f 1 2 99999999999"), "line 4: a triangle has vertex 99999999999"},
       {with(kObj, "f 1 2 3", "f 1 2 3 1"), "line 4: polygon 1 has 4 corners; accepted: triangles only"},
       {with(kObj, "f 1 2 3", "f 1 2"), "line 4: polygon 1 has 2 corners"},
       {with(kObj, "f 1 2 3", "f 1 2 3x"), "line 4: a polygon has the corner '3x'"},
       {with(kObj, "f 1 2 3", "f 1 2 3/a"), "line 4: a polygon has the corner '3/a'"},
       {with(kObj, "v 0 1 5", "v 0 NaN 5"), "line 3: vertex 3 has 'NaN'"},
       {with(kObj, "v 0 1 5", "v 0 1"), "line 3: vertex 3 has no three coordinates"},
       {with(kObj, "v 0 1 5", "v 0 1 5 x"), "line 3: vertex 3 is followed by 'x'"},
       {kObj + "\x7f"
               "ELF",
        "line 5: a statement begins with '?ELF'"},
       {kObj + "curv 0 1 2", "line 5: a statement begins with 'curv'"}},
      "in.obj");
}

TEST(WrongPly, HeadersAreRefusedWithTheirLine) {
  expect_refused({{"plyx\n", "line 1: a PLY does not begin with 'plyx'"},
                  {with(kPly, "ascii", "binary"), "line 2: 'format binary 1.0' is no format"},
                  {with(kPly, "1.0", "2.0"), "line 2: 'format ascii 2.0' is no format"},
                  {with(kPly, "property float y", "property real y"), "line 5: 'property real y' is no property"},
                  {with(kPly, "property float y", "property float"), "line 5: 'property float' is no property"},
                  {with(kPly, "list uchar", "list float"), "line 8: 'property list float int "},
                  {with(kPly, "uchar int", "uchar float"), "line 8: corners are float"},
                  {with(kPly, "property float y", "property float x"), "line 5: there is a property x already"},
                  {with(kPly, "property float z\n", ""), "there is no element vertex with x, y and z"},
                  {with(kPly, "vertex_indices", "corners"), "there is no element face with a list of corners"},
                  {with(kPly, "element face 1", "element vertex 1"), "line 7: there is an element vertex already"},
                  {with(kPly, "element vertex 3", "element vertex three"), "line 3: 'element vertex three' is no element"},
                  {with(kPly, "element vertex 3", "element vertex 4294967296"), "line 3: 4294967296 vertices are too many"},
                  {with(kPly, "element vertex 3\n", ""), "line 3: a property before the first element"},
                  {with(kPly, "element vertex 3", "elements vertex 3"), "line 3: a line begins with 'elements'"},
                  {"ply\nformat ascii 1.0\nelement vertex 3\n", "line 4: the file ends within the header", "mesh-file-short"},
                  {"ply", "line 1: a PLY does not begin"}},
                 "in.ply");
}

TEST(WrongPly, AsciiRowsAreRefusedWithTheirLine) {
  expect_refused({{with(kPly, "3 0 1 2", "3 0 1 3"), "in.ply, line 13: triangle 0 has vertex 3, but there are 3, counted from 0"},
                  {with(kPly, "3 0 1 2", "3 0 1 -1"), "line 13: triangle 0 has vertex -1"},
                  {with(kPly, "3 0 1 2", "3 0 1 1e300"), "line 13: triangle 0 has vertex 1e+300"},
                  {with(kPly, "3 0 1 2", "3 0 1 1.5"), "line 13: face 0 of 1 has a corner that is no whole number"},
                  {with(kPly, "3 0 1 2", "4 0 1 2 0"), "line 13: polygon 0 has 4 corners"},
                  {with(kPly, "3 0 1 2", "-3 0 1 2"), "line 13: face 0 of 1 has a list whose length is no count"},
                  {with(kPly, "3 0 1 2", "nan 0 1 2"), "line 13: face 0 of 1 has a list whose length is no count"},
                  {with(kPly, "3 0 1 2", "3 0 1"), "line 13: face 0 of 1 has a word too few"},
                  {with(kPly, "3 0 1 2", "3 0 1 2 0"), "line 13: face 0 of 1 has a word too many"},
                  {with(kPly, "0 1 5", "0 1 nan"), "line 12: vertex 2 of 3 has a coordinate that is not finite"},
                  {with(kPly, "0 1 5", "0 1 1e39"), "line 12: vertex 2 of 3 has a word too few or one that is no such number"},
                  {with(kPly, "0 1 5", "0 1"), "line 12: vertex 2 of 3 has a word too few"},
                  {with(kPly, "0 1 5", "0 1 5 6"), "line 12: vertex 2 of 3 has a word too many"},
                  {with(kPly, "\n3 0 1 2\n", "\n"), "line 13: the file ends within face 0 of 1", "mesh-file-short"},
                  {kPly + "3 0 1 2\n", "line 14: the file goes on after its last element"}},
                 "in.ply");
}

/// The triangle of the other tests: a header, three vertices of three floats, a face of 13 bytes.
std::string binary_ply(std::endian order, float z, std::uint8_t corners, std::int32_t last) {
  Bytes bytes(order);
  for (const float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, z}) bytes.add(value);
  bytes.add(corners).add(std::int32_t{0}).add(std::int32_t{1}).add(last);
  return with(kPlyHeader, "ascii", order == std::endian::big ? "binary_big_endian" : "binary_little_endian") + bytes.text();
}

TEST(WrongPly, BinaryRowsAreRefusedWithTheirByte) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    const std::string good = binary_ply(order, 5, 3, 2);
    ASSERT_TRUE(read_text(good).ok());
    const std::size_t body = good.find("end_header\n") + 11;
    const auto byte = [&](std::size_t offset) { return "in.ply, byte " + std::to_string(body + offset) + ": "; };
    expect_refused(
        {{binary_ply(order, 5, 3, 3), byte(36) + "triangle 0 has vertex 3, but there are 3"},
         {binary_ply(order, 5, 3, -1), byte(36) + "triangle 0 has vertex -1"},
         {binary_ply(order, 5, 4, 2), byte(36) + "polygon 0 has 4 corners"},
         {binary_ply(order, std::numeric_limits<float>::quiet_NaN(), 3, 2),
          byte(24) + "vertex 2 of 3 has a coordinate that is not finite"},
         {binary_ply(order, -std::numeric_limits<float>::infinity(), 3, 2), byte(24) + "vertex 2 of 3 has a coordinate"},
         {good + "\n", byte(49) + "the file goes on after its last element"},
         {good.substr(0, body + 30), byte(30) + "the file ends within vertex 2 of 3", "mesh-file-short"},
         {good.substr(0, body + 48), byte(48) + "the file ends within face 0 of 1", "mesh-file-short"}},
        "in.ply");
  }
}

TEST(WrongPly, AHugeCountTakesNoMemory) {
  const std::string huge = with(with(kPly, "vertex 3", "vertex 4294967295"), "face 1", "face 18446744073709551615");
  const auto read = read_text(huge);
  ASSERT_FALSE(read.ok());
  EXPECT_THAT(read.problem().detail, HasSubstr("vertex 3 of 4294967295")) << "the face's row is taken for a vertex";
  Bytes list(std::endian::little);
  list.add(std::uint32_t{0xffffffff});
  const auto endless = read_text(
      "ply\nformat binary_little_endian 1.0\nelement blob 1\nproperty list uint double data\nelement vertex 0\nproperty float "
      "x\nproperty float y\n"
      "property float z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n" +
      list.text());
  ASSERT_FALSE(endless.ok());
  EXPECT_THAT(endless.problem().detail, HasSubstr("the file ends within blob 0 of 1"));
}

TEST(WrongFile, WhatItShowsOfItIsShortAndPrintable) {
  const auto read = read_text(with(kOff, "0 1 5", "0 1 " + std::string(100000, '\1')));
  ASSERT_FALSE(read.ok());
  EXPECT_LT(read.problem().detail.size(), 100u);
  EXPECT_EQ(read.problem().detail.find('\1'), std::string::npos);
  const auto digits = read_text(with(kOff, "0 1 5", "0 1 1." + std::string(500, '0') + "e5"));
  EXPECT_FALSE(digits.ok()) << "a number whose end was cut off is another number";
}

TEST(WrongFile, UnknownOnesAreNamed) {
  const auto read = read_text("solid hill\n", "hill.stl");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.problem().type, "mesh-format-unknown");
  EXPECT_THAT(read.problem().line(), AllOf(HasSubstr("hill.stl"), HasSubstr("accepted: PLY, OFF or OBJ")));
  EXPECT_EQ(read_mesh_file("/no/such.ply").problem().type, "file-unreadable");
  EXPECT_EQ(read_mesh_file("/").problem().type, "file-unreadable");
}

// A file cut off anywhere is refused, or says the same mesh: no prefix is taken for another mesh. OBJ has no counts, so there a
// prefix may be a smaller mesh, and only its soundness can be asked for.
bool sound(const TriangleMesh& mesh) {
  for (const auto& triangle : mesh.triangles) {
    for (const auto corner : triangle) {
      if (corner >= mesh.vertices()) return false;
    }
  }
  for (const auto* axis : {&mesh.x, &mesh.y, &mesh.z}) {
    if (axis->size() != mesh.vertices()) return false;
    for (const double value : *axis) {
      if (!std::isfinite(value)) return false;
    }
  }
  return true;
}

std::vector<MeshEncoding> all_encodings() {
  std::vector<MeshEncoding> all;
  for (const auto format :
       {MeshFormat::off, MeshFormat::ply_ascii, MeshFormat::ply_little_endian, MeshFormat::ply_big_endian, MeshFormat::obj}) {
    all.push_back({format, CoordinateType::float64});
  }
  all.push_back({MeshFormat::ply_ascii, CoordinateType::float32});
  all.push_back({MeshFormat::ply_big_endian, CoordinateType::float32});
  return all;
}

TEST(BrokenFile, CutOffAtEveryByte) {
  for (const MeshEncoding& encoding : all_encodings()) {
    const std::string whole = written(roof(), encoding);
    const auto unbroken = read_text(whole, "in.obj");
    ASSERT_TRUE(unbroken.ok());
    std::size_t refused = 0;
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const auto read = read_text(whole.substr(0, size), encoding.format == MeshFormat::obj ? "in.obj" : "in.ply");
      refused += !read.ok();
      if (!read.ok()) continue;
      EXPECT_TRUE(sound(read->mesh)) << name_of(encoding.format) << " cut at " << size;
      if (encoding.format != MeshFormat::obj) {
        EXPECT_TRUE(same(read->mesh, unbroken->mesh)) << name_of(encoding.format) << " cut at " << size;
      }
    }
    EXPECT_GT(refused, encoding.format == MeshFormat::obj ? 20 : whole.size() - 6) << name_of(encoding.format);
  }
}

TEST(BrokenFile, AnyByteMadeAnother) {
  std::size_t refused = 0;
  for (const MeshEncoding& encoding : all_encodings()) {
    const std::string whole = written(roof(), encoding);
    for (std::size_t at = 0; at < whole.size(); ++at) {
      for (const char byte : {'\0', '\n', ' ', '-', '9', 'x', '\\', '#', '\xff'}) {
        std::string broken = whole;
        broken[at] = byte;
        const auto read = read_text(broken, "in.obj");
        refused += !read.ok();
        EXPECT_TRUE(!read.ok() || sound(read->mesh)) << name_of(encoding.format) << ", byte " << at;
      }
    }
  }
  EXPECT_GT(refused, 1000u);
}

}  // namespace
}  // namespace cordillera::proto
