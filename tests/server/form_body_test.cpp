// Multipart forms, read piece by piece.
#include "server/http/form_body.h"

#include <gmock/gmock.h>

#include "form_text.h"

namespace cordillera::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

struct Read {
  bool whole = false;
  std::string file, problem;
  std::vector<std::pair<std::string, std::string>> fields;
  std::string name;
};
Read read_form(const std::string& form, std::size_t size, const std::string& type = kForm) {
  auto reader = FormReader::of(type);
  Read read;
  bool going = true;
  for (std::size_t at = 0; at < form.size() && going; at += size) {
    going = reader->feed(std::string_view(form).substr(at, size), [&](std::string_view piece) {
      read.file += piece;
      return true;
    });
  }
  read.whole = reader->ended();
  if (reader->problem()) read.problem = reader->problem()->detail;
  read.fields = reader->fields();
  for (const std::string& name : reader->file_names()) read.name += (read.name.empty() ? "" : "|") + name;
  return read;
}

TEST(Form, IsReadWhereverItIsCut) {
  const std::string bytes = "GOOD\r\n--b\r\n--b \r\n-\r\n\r\n--bo\r";  // what looks like a boundary and is none
  const std::string form = "words before\r\n" + form_part("name=error", "5") +
                           form_file(bytes, "C:\\a\\h\xc3\xb6he \\\"1\\\".tif") + form_part("name=\"title\"", "") +
                           "--b o-- \r\nwords behind";
  for (std::size_t size = 1; size <= form.size(); ++size) {
    const Read got = read_form(form, size);
    ASSERT_TRUE(got.whole) << size << got.problem;
    ASSERT_EQ(got.file, bytes) << size;
    ASSERT_THAT(got.fields, ElementsAre(Pair("error", "5"), Pair("title", ""))) << size;
    ASSERT_EQ(got.name, "h\xc3\xb6he \"1\".tif") << size;
  }
}

TEST(Form, MayHoldSeveralFiles) {
  const std::string form =
      form_file("one", "a.tif") + form_part("name=error", "5") + form_file("two", "b/c.tif") + form_file("", "d.tif") + kFormEnd;
  for (const std::size_t size : {1, 7, 1000}) {
    const Read got = read_form(form, size);
    EXPECT_TRUE(got.whole);
    EXPECT_EQ(got.file, "onetwo");
    EXPECT_EQ(got.name, "a.tif|c.tif|d.tif");
  }
}

TEST(Form, ThatCannotBeReadIsToldWhy) {
  std::string many;
  for (int k = 0; k < 257; ++k) many += form_file("a");
  EXPECT_THAT(read_form(many + kFormEnd, 999).problem, HasSubstr("more than 256 files"));
  std::string parts;
  for (int k = 0; k < 513; ++k) parts += "--b o\r\nContent-Disposition:;name=\r\n\r\n\r\n";
  EXPECT_THAT(read_form(parts + kFormEnd, 999).problem, HasSubstr("more than 512 parts"));
  std::string names;
  for (int k = 0; k < 9; ++k) names += form_part("name=" + std::string(8000, 'x'), "");
  EXPECT_THAT(read_form(names + kFormEnd, 999).problem, HasSubstr("64 KiB")) << "names count, too";
  EXPECT_THAT(
      read_form(
          "--b o\r\nContent-Disposition: form-data; name=\"file\"\r\nContent-Type: multipart/mixed; boundary=c\r\n\r\n--c\r\n", 9)
          .problem,
      HasSubstr("curl -F file=@a.tif,b.tif"));
  EXPECT_THAT(read_form(form_part("filename=x", "a") + kFormEnd, 9).problem, HasSubstr("no name"));
  EXPECT_THAT(read_form("--b oX\r\n", 9).problem, HasSubstr("other words"));
  EXPECT_THAT(read_form(form_part("name=a", std::string(70000, 'x')), 999).problem, HasSubstr("64 KiB"));
  EXPECT_THAT(read_form("--b o\r\nA: " + std::string(9000, 'x'), 999).problem, HasSubstr("8 KiB"));
  EXPECT_FALSE(read_form(form_file("a"), 9).whole) << "the last boundary is missing";
  EXPECT_FALSE(FormReader::of("multipart/mixed; boundary=a"));
  EXPECT_FALSE(FormReader::of("multipart/form-data; boundary=" + std::string(71, 'x')));
}

/// requests.post(…, files=…, headers={"Content-Type": "multipart/form-data"}): the header that the library would have set.
TEST(Form, WithoutABoundaryInItsTypeSaysItInItsFirstLine) {
  const std::string form = form_part("name=error", "5") + form_file("GOOD") + kFormEnd;
  for (const char* type : {"multipart/form-data", "multipart/form-data; charset=utf-8", "multipart/form-data; boundary="}) {
    for (std::size_t size = 1; size <= form.size(); ++size) {
      const Read got = read_form(form, size, type);
      ASSERT_TRUE(got.whole) << size << got.problem;
      ASSERT_EQ(got.file, "GOOD") << size;
      ASSERT_THAT(got.fields, ElementsAre(Pair("error", "5"))) << size;
    }
  }
  const std::string longest = "--" + std::string(71, 'x');
  for (const std::string& none :
       {std::string("GOOD"), std::string("--"), std::string("--\r\n"), longest, longest + "\r\n", "\r\n" + form}) {
    const Read got = read_form(none + std::string(100, 'y'), 3, "multipart/form-data");
    EXPECT_FALSE(got.whole);
    EXPECT_THAT(got.problem, HasSubstr("clients set that header by themselves")) << none;
  }
}

}  // namespace
}  // namespace cordillera::server
