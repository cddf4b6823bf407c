// The table of bad inputs: what each of them is answered with, in a process of its own, and what it costs. bad_inputs.tsv is the
// table as it should be: name and answer. CORDILLERA_WRITE_TABLE=FILE writes the table as it is, with memory and time.
#include <gdal_version.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "bad_rows.h"
#include "tests/sanitized.h"

namespace cordillera::raster_test {
namespace {

using BadTable = RasterTest;
using raster::Trust;

// Beyond what the test has: what a posted raster may take is more. A sanitizer's own memory counts too.
constexpr rlim_t kMemory = kSanitized ? RLIM_INFINITY : rlim_t{1} << 30;
constexpr long kMostMegabytes = kSanitized ? 4000 : 700;
constexpr unsigned kSeconds = 100;  // a hang, on any machine

struct Answer {
  std::string slug;  ///< "accepted": it opens and can be sampled
  long megabytes = 0;
  double seconds = 0;
};

/// Opens and samples; every height must be one that a tile may have.
std::string outcome(const std::string& path, const BadRow& row) {
  auto source = open(path, row.options, Trust::posted_file, row.file);
  if (!source.ok()) return source.problem().type;
  const proto::Lattice l = lattice(7);
  const auto w = (*source)->window(l);
  const std::int64_t columns = std::min<std::int64_t>(w.east - w.west + 1, 600),
                     rows = std::min<std::int64_t>(w.north - w.south + 1, 600);
  if (columns < 1 || rows < 1) return "accepted";
  const auto samples = (*source)->sample(l, w.west, w.south, static_cast<std::int32_t>(columns), static_cast<std::int32_t>(rows));
  if (!samples.ok()) return samples.problem().type;
  for (const std::int32_t height : samples->height) {
    if (height != proto::kNoHeight && std::abs(height * proto::kHeightStep_m) > proto::kMaxHeight_m + 200)
      return "impossible height";
  }
  const auto pixels = (*source)->pixels(l, {w.west, w.south, w.west + columns, w.south + rows});
  if (!pixels.ok()) return pixels.problem().type;
  const bool finite = std::all_of(pixels->begin(), pixels->end(), [](const auto& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.height_m);
  });
  return finite ? "accepted" : "no number";
}

Answer in_a_child(const std::string& path, const BadRow& row) {
  int ends[2];
  if (pipe(ends) != 0) return {"no pipe", 0, 0};
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    alarm(kSeconds);
    const rlimit none{0, 0}, memory{kMemory, kMemory};
    setrlimit(RLIMIT_CORE, &none);
    setrlimit(RLIMIT_DATA, &memory);
    setenv("TMPDIR", std::filesystem::path(path).parent_path().c_str(), 1);  // copies of archives would outlive the child there
    std::string said;
    try {
      said = outcome(path, row);
    } catch (const std::exception& error) { said = std::string("exception: ") + error.what(); }
    [[maybe_unused]] const auto sent = write(ends[1], said.data(), said.size());
    _exit(0);
  }
  close(ends[1]);
  Answer answer;
  char text[256];
  for (ssize_t count = 0; (count = read(ends[0], text, sizeof text)) > 0;)
    answer.slug.append(text, static_cast<std::size_t>(count));
  close(ends[0]);
  int status = 0;
  rusage used{};
  wait4(child, &status, 0, &used);
  if (WIFSIGNALED(status)) answer.slug = "ended by signal " + std::to_string(WTERMSIG(status));
  answer.megabytes = used.ru_maxrss / 1024;
  answer.seconds = static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
                   static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec) / 1e6;
  return answer;
}

std::string bytes_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::map<std::string, std::string> expected() {
  std::map<std::string, std::string> table;
  std::ifstream in(CORDILLERA_SOURCE_DIR "/tests/raster/bad_inputs.tsv");
  for (std::string line; std::getline(in, line);) {
    const auto tab = line.find('\t');
    if (!line.empty() && line[0] != '#' && tab != line.npos) table[line.substr(0, tab)] = line.substr(tab + 1);
  }
  return table;
}

/// known: an answer, or "one or another": that of GDAL 3.6, and what a later one may say, too.
bool is_one_of(const std::string& known, const std::string& slug) {
  const std::string between = " or ";
  const auto at = known.find(between);
  const bool later = at != known.npos && GDAL_VERSION_NUM >= GDAL_COMPUTE_VERSION(3, 7, 0);
  return slug == known.substr(0, at) || (later && slug == known.substr(at + between.size()));
}

/// A name on one line of text.
std::string plain(std::string name) {
  for (char& c : name) {
    if (static_cast<unsigned char>(c) < 32 || static_cast<unsigned char>(c) > 126) c = '?';
  }
  return name;
}

TEST_F(BadTable, EveryRowHasItsAnswerAndItsBounds) {
  const Maker make = [this](const Spec& spec, const std::string& name) {
    std::string bytes = bytes_of(write(spec, name));
    for (const auto& entry : std::filesystem::directory_iterator(path("")))
      std::filesystem::remove_all(entry.path());  // sidecars too
    return bytes;
  };
  std::vector<BadRow> rows;
  for (auto& made : {cut_rows(make), sent_bad_rows(), tag_rows(make), size_rows(make), place_rows(make), text_rows()})
    rows.insert(rows.end(), made.begin(), made.end());
  const auto table = expected();
  const char* written = std::getenv("CORDILLERA_WRITE_TABLE");
  std::ofstream out;
  if (written != nullptr) out.open(written);
  std::set<std::string> names;
  for (const BadRow& row : rows) {
    const std::string name = plain(row.name), file = write_text(row.bytes, "posted");
    EXPECT_TRUE(names.insert(name).second) << name << " is there twice";
    const Answer answer = in_a_child(file, row);
    if (out) out << name << '\t' << answer.slug << '\t' << answer.megabytes << '\t' << answer.seconds << '\n';
    const auto found = table.find(name);
    const std::string known = found == table.end() ? "(no row)" : found->second;
    EXPECT_TRUE(is_one_of(known, answer.slug)) << name << ": " << answer.slug << " instead of " << known;
    EXPECT_LT(answer.megabytes, kMostMegabytes) << name;
  }
  EXPECT_GE(names.size(), 150u);
  EXPECT_EQ(names.size(), table.size()) << "the table has rows that are made no more";
}

/// Where there is memory for them, too: nothing is taken for such a block.
TEST_F(BadTable, BlocksFarLargerThanTheRasterAreTold) {
  int told = 0;
  for (const BadRow& row : size_rows([this](const Spec&spec, const std::string&name) { return bytes_of(write(spec, name)); })) {
    if (row.name != "tile width 1073741824" && row.name != "tile height 1073741824") continue;
    const auto opened = open(write_text(row.bytes, "posted"), row.options, Trust::posted_file, row.file);
    ASSERT_FALSE(opened.ok());
    EXPECT_NE(opened.problem().detail.find("its header claims blocks of "), std::string::npos) << opened.problem().detail;
    ++told;
  }
  EXPECT_EQ(told, 2);
}

/// What lies beside a posted file is not its own: the answer is that of the file alone.
TEST_F(BadTable, SidecarsAreNotRead) {
  Spec spec;
  spec.columns = spec.rows = 40;
  const std::string file = write(spec);
  const auto alone = must_open(file, plain_options(), Trust::posted_file);
  ASSERT_TRUE(alone);
  Spec liar = spec;
  liar.value = [](int, int) { return 9000.0; };
  std::filesystem::copy_file(write(liar, "liar.tif"), path("dem.tif.ovr"));
  write_text(
      "<PAMDataset><PAMRasterBand "
      "band=\"1\"><NoDataValue>100</NoDataValue><UnitType>ft</UnitType><Scale>7</Scale></PAMRasterBand></PAMDataset>",
      "dem.tif.aux.xml");
  write_text("1\n0\n0\n-1\n100\n10\n", "dem.tfw");
  write_text("LOCAL_CS[\"nowhere\"]", "dem.prj");
  const std::filesystem::path mask = path("dem.tif.msk");
  std::filesystem::copy_file(path("dem.tif.ovr"), mask);
  const auto beside = must_open(file, plain_options(), Trust::posted_file);
  ASSERT_TRUE(beside);
  EXPECT_EQ(beside->description().SerializeAsString(), alone->description().SerializeAsString());
  const proto::Lattice l = lattice(4);
  EXPECT_EQ(whole(*beside, l).height, whole(*alone, l).height);
}

TEST_F(BadTable, TheCollectionHasAnswersToo) {
  const std::string folder = real_dems() + "/bad";
  if (real_dems().empty() || !std::filesystem::is_directory(folder))
    GTEST_SKIP() << "no collection of bad files: set CORDILLERA_TEST_DATA";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".md") continue;
    const BadRow row{entry.path().filename().string(), entry.path().filename().string(), "", plain_options()};
    const Answer answer = in_a_child(entry.path().string(), row);
    EXPECT_NE(answer.slug.rfind("ended", 0), 0u) << row.name << ": " << answer.slug;
    EXPECT_NE(answer.slug.rfind("exception", 0), 0u) << row.name << ": " << answer.slug;
    EXPECT_LT(answer.megabytes, kMostMegabytes) << row.name;
  }
}

}  // namespace
}  // namespace cordillera::raster_test
