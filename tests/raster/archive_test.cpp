// Archives of one raster: what is taken out of them, and what never is.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <set>
#include <vector>

#include "raster/archive/archive.h"
#include "raster/disk/free_space.h"
#include "raster/gdal/formats.h"
#include "raster/open/at_hand.h"
#include "sent.h"

namespace cordillera::raster_test {
namespace {

namespace fs = std::filesystem;
using raster::Trust;

class Archive : public RasterTest {
 protected:
  Archive() : tiff_(bytes_of(write(hills(), "good.tif"))), good_(must_open(path("good.tif"))) {}

  proto::Problem refused(const std::string& archive, const std::string& name) {
    const auto source = open(archive, plain_options(), Trust::posted_file, name);
    if (!source.ok()) return source.problem();
    ADD_FAILURE() << name << " opens";
    return {};
  }
  std::string zipped(const std::vector<std::pair<std::string, std::string>>& files) {
    const std::string file = path("z" + std::to_string(++count_) + ".zip");
    zip_bytes(file, files);
    return file;
  }

  const std::string tiff_;
  const std::unique_ptr<raster::Source> good_;

 private:
  int count_ = 0;
};

/// What is stored without compression, too.
TEST_F(Archive, WhoseChecksumsAreOthersAreDamaged) {
  const std::string zip = path("stored.zip");
  ASSERT_EQ(std::system(("cd '" + fs::path(zip).parent_path().string() +
                         "' && python3 -c \"import zipfile; "
                         "zipfile.ZipFile('stored.zip', 'w').write('good.tif')\"")
                            .c_str()),
            0);
  EXPECT_TRUE(must_open(zip, plain_options(), Trust::posted_file, "dem.zip"));
  std::string bytes = bytes_of(zip);
  const std::size_t at = bytes.find(tiff_) + tiff_.size() / 2;
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  const auto damaged = refused(write_text(bytes, "damaged.zip"), "damaged.zip");
  EXPECT_EQ(damaged.type, "archive-unreadable");
  EXPECT_EQ(damaged.detail, "damaged.zip cannot be unpacked: good.tif has another checksum than it says");
}

TEST_F(Archive, WhatLiesBesideTheRasterIsLeftOut) {
  ASSERT_TRUE(good_);
  // A PAM file and an overview would change what is read; they could name any file.
  Spec liar = hills();
  liar.value = [](int, int) { return 9000; };
  const std::string lies = bytes_of(write(liar, "liar.tif"));
  const std::string zip =
      zipped({{"a/README.txt", "read me"},
              {"__MACOSX/a/._dem.tif", "x"},
              {"a/dem.tif.aux.xml", "<PAMDataset><PAMRasterBand band=\"1\"><Scale>7</Scale></PAMRasterBand></PAMDataset>"},
              {"a/dem.tif.ovr", lies},
              {"a/dem.tif", tiff_}});
  for (const Trust trust : {Trust::posted_file, Trust::operator_file}) {
    const auto source = must_open(zip, plain_options(), trust, "dem.zip");
    ASSERT_TRUE(source);
    expect_same_heights(*good_, *source);
  }
}

/// GDAL's own list of these takes seconds to minutes.
TEST_F(Archive, OfManyFoldersOrDeepPathsIsRefusedAtOnce) {
  ASSERT_TRUE(good_);
  std::vector<std::pair<std::string, std::string>> folders{{"dem.tif", tiff_}};
  for (int k = 0; k < 11000; ++k) folders.emplace_back(std::to_string(k) + "/", "");
  std::string deep, fine;
  for (int k = 0; k < 100; ++k) deep += "a/";
  for (int k = 0; k < 20; ++k) fine += "a/";
  for (const auto& files : {folders,
                            {{deep + "dem.tif", tiff_}},
                            {{std::string(5000, 'a') + "/dem.tif", tiff_}},
                            {{"dem.tif", tiff_}, {"../dem.tif", tiff_}},
                            {{"/tmp/dem.tif", tiff_}}}) {
    const auto refusal = refused(zipped(files), "dem.zip");
    EXPECT_EQ(refusal.type, "archive-unreadable") << refusal.line();
    EXPECT_NE(refusal.accepted.find("64 folders"), std::string::npos) << refusal.line();
  }
  EXPECT_TRUE(open(zipped({{fine + "dem.tif", tiff_}}), plain_options(), Trust::posted_file, "dem.zip").ok());
  std::string more = bytes_of(zipped({{"dem.tif", tiff_}}));
  const std::size_t end = more.rfind("PK\x05\x06");
  more[end + 8] = more[end + 10] = 2;  // files that the list is said to have
  const auto refusal = refused(write_text(more, "more.zip"), "more.zip");
  EXPECT_NE(refusal.line().find("ends early"), std::string::npos) << refusal.line();
}

/// GDAL takes seconds to minutes for more.
TEST_F(Archive, ATiffOfThousandsOfDirectoriesIsRefusedAtOnce) {
  const auto number = [&](std::size_t at, std::size_t bytes) {
    std::size_t value = 0;
    for (std::size_t k = bytes; k-- > 0;) value = value << 8 | static_cast<unsigned char>(tiff_[at + k]);
    return value;
  };
  const std::size_t first = number(4, 4), bytes = 2 + 12 * number(first, 2);
  const auto chain = [&](int more) {
    std::string tiff = tiff_;
    std::size_t next = first + bytes;
    for (int k = 0; k < more; ++k) {
      if (tiff.size() % 2 > 0) tiff.push_back(0);
      for (std::size_t n = 0; n < 4; ++n) tiff[next + n] = static_cast<char>(tiff.size() >> 8 * n);
      next = tiff.size() + bytes;
      tiff.append(tiff_, first, bytes).append(4, 0);
    }
    return tiff;
  };
  const auto refusal = refused(write_text(chain(2000), "chain.tif"), "chain.tif");
  EXPECT_EQ(refusal.type, "raster-unreadable") << refusal.line();
  EXPECT_NE(refusal.line().find("2000 directories"), std::string::npos) << refusal.line();
  EXPECT_TRUE(open(write_text(chain(300), "pages.tif"), plain_options(), Trust::posted_file, "pages.tif").ok());
}

/// Left out, its masked pixels would become heights.
TEST_F(Archive, AMaskBesideTheRasterIsRefusedWithTheLineThatPutsItInside) {
  ASSERT_TRUE(good_);
  const auto refusal = refused(zipped({{"dem.tif", tiff_}, {"dem.tif.msk", tiff_}}), "dem.zip");
  EXPECT_EQ(refusal.type, "archive-rasters");
  EXPECT_NE(refusal.line().find("GDAL_TIFF_INTERNAL_MASK YES dem.tif dem-2.tif"), std::string::npos) << refusal.line();
  EXPECT_TRUE(open(zipped({{"dem.tif", tiff_}, {"other.tif.msk", tiff_}}), plain_options(), Trust::posted_file, "dem.zip").ok());
  EXPECT_TRUE(raster::is_side_of("d.jp2", "d.j2w")) << "the world file of JPEG 2000";
}

/// What programs of Esri write: the TIFF says nothing of its place, two files beside it do.
TEST_F(Archive, WhatSaysWhereTheRasterLiesIsRead) {
  ASSERT_TRUE(good_);
  Spec bare = hills();
  bare.crs = "", bare.georeferenced = false;
  const std::string nowhere = bytes_of(write(bare, "nowhere.tif"));
  bare.georeferenced = true;
  const std::string somewhere = bytes_of(write(bare, "somewhere.tif"));
  const std::string world = "0.01\n0\n0\n-0.01\n10.005\n44.995\n";
  const std::string prj =
      "\n"
      R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],)"
      R"(PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
  const std::string pam =
      "<PAMDataset><SRS>EPSG:4326</SRS><PAMRasterBand band=\"1\"><Scale>7</Scale></PAMRasterBand></PAMDataset>";
  Spec points = bare;
  points.driver = "XYZ", points.type = "Float32";
  points.value = [all = hills().value](int c, int r) {
    return all(c, r) == -9999 ? -32768 : all(c, r);
  };  // it has no word for no data
  const std::string kinds[] = {zipped({{"dem.tif", nowhere}, {"dem.tfw", world}, {"dem.prj", prj}}),
                               zipped({{"a/DEM.TIF", somewhere}, {"a/DEM.PRJ", prj}}),
                               zipped({{"dem.tif", somewhere}, {"dem.tif.aux.xml", pam}}),
                               zipped({{"dem.xyz", bytes_of(write(points, "dem.xyz"))}, {"dem.prj", prj}})};
  for (const std::string& zip : kinds) {
    for (const Trust trust : {Trust::posted_file, Trust::operator_file}) {
      const auto source = must_open(zip, plain_options(), trust, "dem.zip");
      ASSERT_TRUE(source) << zip;
      EXPECT_EQ(source->description().crs_from(), "source");
      expect_same_heights(*good_, *source);
    }
  }
  EXPECT_EQ(refused(zipped({{"dem.tif", nowhere}, {"other.tfw", world}, {"dem.prj", prj}}), "dem.zip").type,
            "raster-not-georeferenced");
  EXPECT_EQ(refused(zipped({{"dem.tif", somewhere}, {"b/dem.prj", prj}}), "dem.zip").type, "raster-without-crs");
  const std::string liar = "<PAMDataset><SRS>/etc/hostname</SRS></PAMDataset>";
  EXPECT_EQ(refused(zipped({{"dem.tif", somewhere}, {"dem.tif.aux.xml", liar}}), "dem.zip").type, "raster-without-crs");
}

TEST_F(Archive, PathsInItLeadNowhere) {
  ASSERT_TRUE(good_);
  fs::create_directory(path("tmp"));
  const char* usual = std::getenv("TMPDIR");
  const std::string before = usual != nullptr ? usual : "";
  setenv("TMPDIR", path("tmp").c_str(), 1);
  for (const std::string name : {"../../../outside.tif", "..\\..\\outside.tif", "/outside.tif", "a b;$(x).tif", "..tif.tif"}) {
    SCOPED_TRACE(name);
    const auto source = open(zipped({{name, tiff_}}), plain_options(), Trust::posted_file, "dem.zip");
    if (source.ok()) expect_same_heights(*good_, **source);
    if (!source.ok()) { EXPECT_EQ(source.problem().type.rfind("archive-", 0), 0u) << source.problem().line(); }
  }
  usual != nullptr ? setenv("TMPDIR", before.c_str(), 1) : unsetenv("TMPDIR");
  for (const auto& entry : fs::recursive_directory_iterator(path(""))) {
    const bool kept = entry.path().string().find("/tmp/cordillera-") != std::string::npos;  // the last few copies stay a little
    EXPECT_FALSE(entry.path().filename().string().find("outside") != std::string::npos && !kept) << entry.path();
  }
}

TEST_F(Archive, OfAFolderOfTilesIsThatFolder) {
  const auto files = [](const raster::PrivateFolder& folder) {
    std::vector<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(folder.path()))
      if (entry.is_regular_file()) names.push_back(fs::relative(entry.path(), folder.path()).string());
    std::sort(names.begin(), names.end());
    return names;
  };
  const std::string zip = zipped({{"readme", "x"},
                                  {"out/manifest.json", "{}"},
                                  {"out/archive.zip", "x"},
                                  {"out/tiles/0/0/0.drc", "tile"},
                                  {"out/old/manifest.json", "[]"},
                                  {"b/c", "x"}});
  {
    const raster::PrivateFolder folder;
    const auto found = raster::unpack_folder(zip, "a.zip", "manifest.json", folder);
    ASSERT_TRUE(found.ok() && *found);
    using Names = std::vector<std::string>;
    EXPECT_EQ(files(folder), (Names{"archive.zip", "manifest.json", "old/manifest.json", "tiles/0/0/0.drc"}));
    EXPECT_EQ(bytes_of(folder.path() + "/tiles/0/0/0.drc"), "tile");
    EXPECT_EQ(bytes_of(zip).substr(0, 2), "PK") << "written over";
  }
  for (const auto& [file, name] : {std::pair{zipped({{"a.tif", tiff_}}), "no.zip"}, {path("good.tif"), "good.tif"}}) {
    const raster::PrivateFolder folder;
    const auto none = raster::unpack_folder(file, name, "manifest.json", folder);
    EXPECT_TRUE(none.ok() && !*none) << name;
  }
  for (const std::string evil : {"../../outside", "/outside", "a/../../outside", "..\\outside"}) {
    const raster::PrivateFolder folder;
    const auto found = raster::unpack_folder(zipped({{"manifest.json", "{}"}, {evil, "x"}}), "a.zip", "manifest.json", folder);
    for (const std::string& name : {folder.path() + "/../../outside", folder.path() + "/../outside", std::string("/outside")})
      EXPECT_FALSE(fs::exists(name)) << evil;
    if (!found.ok()) { EXPECT_EQ(found.problem().type, "archive-unreadable"); }
  }
}

TEST_F(Archive, OneRasterAndNoOther) {
  const proto::Problem two = refused(zipped({{"a.tif", tiff_}, {"b/c.tif", tiff_}}), "two.zip");
  EXPECT_EQ(two.type, "archive-rasters");
  EXPECT_EQ(two.accepted,
            "a .zip with one raster; of several, the rasters (posted as one form: curl -F file=@a.tif -F file=@b.tif), or the "
            "folder that it unpacks to");
  EXPECT_EQ(two.detail, "two.zip holds 2 rasters: a.tif, b/c.tif");
  EXPECT_EQ(refused(zipped({{"a\nb.tif", tiff_}, {"c\r.tif", tiff_}}), "lines.zip").detail,
            "lines.zip holds 2 rasters: a b.tif, c .tif");
  EXPECT_EQ(refused(zipped({{"a.pdf", "%PDF"}, {"b.txt", "x"}}), "none.zip").type, "archive-rasters");
  const proto::Problem nested = refused(zipped({{"inner.zip", "PK\x03\x04nothing"}}), "nested.zip");
  EXPECT_EQ(nested.type, "raster-format-unsupported");
  EXPECT_EQ(nested.detail, "nested.zip holds an archive, inner.zip");
  using namespace std::string_literals;
  for (const auto& [bytes, kind] : {std::pair{"\xfd"
                                              "7zXZ\0\0\4"s,
                                              "packed with xz"s},
                                    {"BZh91AY&SY"s, "packed with bzip2"},
                                    {"7z\xbc\xaf\x27\x1c\0\4"s, "packed with 7-Zip"},
                                    {"Rar!\x1a\7\1\0"s, "packed with RAR"},
                                    {"\x28\xb5\x2f\xfd\4"s, "packed with Zstandard"},
                                    {std::string(257, 'a') + "ustar", "a tar archive"}}) {
    const proto::Problem packed = refused(write_text(bytes, "dem.tif"), "dem.tif");
    EXPECT_EQ(packed.detail, "dem.tif is " + kind);
    EXPECT_EQ(packed.accepted, "the raster that it holds, as it is or in a .zip or .gz");
  }
  EXPECT_EQ(refused(write_text("PK\x03\x04 and no list", "cut.zip"), "cut.zip").type, "archive-unreadable");
}

TEST_F(Archive, DamageIsNamed) {
  const std::string zip = zipped({{"dem.tif", tiff_}});
  std::string bytes = bytes_of(zip);
  for (std::size_t k = 100; k < 140; ++k) bytes[k] = static_cast<char>(bytes[k] ^ 0x55);
  EXPECT_EQ(refused(write_text(bytes, "bad.zip"), "bad.zip").type, "archive-unreadable");
  bytes = bytes_of(zip);
  for (const std::size_t at : {std::size_t{8}, bytes.rfind("PK\1\2") + 10}) bytes[at] = 12;  // bzip2
  const proto::Problem other = refused(write_text(bytes, "other.zip"), "other.zip");
  EXPECT_EQ(other.detail, "other.zip cannot be unpacked") << "words of GDAL's sources";
  EXPECT_EQ(other.accepted, "a complete, undamaged archive without a password, deflated as usual");
  const std::string gz = path("dem.tif.gz");
  gzip_file(gz, path("good.tif"));
  const auto source = must_open(gz, plain_options(), Trust::posted_file, "dem.tif.gz");
  ASSERT_TRUE(source);
  expect_same_heights(*good_, *source);
  bytes = bytes_of(gz);
  EXPECT_EQ(refused(write_text(bytes.substr(0, bytes.size() - 20), "cut.gz"), "dem.tif.gz").type, "archive-unreadable");
  EXPECT_EQ(refused(write_text(bytes.substr(0, 12), "head.gz"), "dem.tif.gz").type, "archive-unreadable");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x55);
  EXPECT_EQ(refused(write_text(bytes, "flipped.gz"), "dem.tif.gz").type, "archive-unreadable");
}

/// Eight MiB of zeros where four are too much; a gz does not say how much it holds, a zip may lie.
TEST_F(Archive, BombsAreBounded) {
  const raster::UnpackLimit limit{.times = 2, .at_least = std::uint64_t{4} << 20};
  const std::string zeros = write_text(std::string(std::size_t{8} << 20, '\0'), "zeros.tif"), gz = path("bomb.tif.gz"),
                    zip = path("bomb.zip");
  gzip_file(gz, zeros);
  zip_files(zip, {{"dem.tif", zeros}});
  std::string lies = bytes_of(zip);
  const std::string true_size("\0\0\x80\0", 4), false_size("\0\4\0\0", 4);  // a kibibyte, in both of its lists
  for (std::size_t at = 0; (at = lies.find(true_size, at)) != std::string::npos; at += 4) lies.replace(at, 4, false_size);
  for (const std::string& bomb : {gz, zip}) {
    const raster::PrivateFolder folder;
    const auto member = raster::unpack(bomb, "bomb", folder, limit);
    ASSERT_FALSE(member.ok());
    EXPECT_EQ(member.problem().type, "archive-too-large");
    EXPECT_EQ(member.problem().detail, "bomb would unpack to more than 4 MiB");
  }
  const raster::PrivateFolder folder;
  const auto lied = raster::unpack(write_text(lies, "lies.zip"), "lies.zip", folder, limit);
  ASSERT_FALSE(lied.ok());
  EXPECT_EQ(lied.problem().type.rfind("archive-", 0), 0u) << lied.problem().line();
}

/// What others need of the disk stays free, though the archive may be as large by its own bound.
TEST_F(Archive, WhatIsUnpackedLeavesAShareOfTheDisk) {
  const std::string zeros = write_text(std::string(std::size_t{8} << 20, '\0'), "zeros.tif"), gz = path("zeros.tif.gz"),
                    zip = path("zeros.zip");
  gzip_file(gz, zeros);
  zip_files(zip, {{"dem.tif", zeros}});
  raster::keep_free(fs::space(path(".")).available - (std::uint64_t{1} << 20));
  for (const std::string& archive : {gz, zip}) {
    const raster::PrivateFolder folder;
    const auto member = raster::unpack(archive, "zeros", folder);
    ASSERT_FALSE(member.ok()) << archive;
    EXPECT_EQ(member.problem().type, "storage-full") << archive;
    EXPECT_NE(member.problem().detail.find("no room for what zeros unpacks to"), std::string::npos) << member.problem().detail;
  }
  raster::keep_free(0);
  const raster::PrivateFolder folder;
  EXPECT_TRUE(raster::unpack(gz, "zeros", folder).ok());
}

TEST_F(Archive, AFolderIsUnpackedUntilItIsStopped) {
  const std::string text = write_text("{}", "manifest.json"), zip = path("folder.zip");
  zip_files(zip, {{"out/manifest.json", text}, {"out/tiles/0.drc", text}});
  for (const bool stopped : {false, true}) {
    const std::atomic<bool> stop{stopped};
    const raster::PrivateFolder folder;
    const auto done = raster::unpack_folder(zip, "folder.zip", "manifest.json", folder, &stop);
    EXPECT_EQ(done ? "" : done.problem().type, stopped ? "cancelled" : "");
    EXPECT_EQ(fs::exists(fs::path(folder.path()) / "tiles" / "0.drc"), !stopped);
  }
}

/// Unpacked once, however often it is opened; another file under the same name is another.
TEST_F(Archive, CopiesAreSharedAndLetGo) {
  ASSERT_TRUE(good_);
  fs::create_directory(path("tmp"));
  const char* usual = std::getenv("TMPDIR");
  const std::string before = usual != nullptr ? usual : "";
  setenv("TMPDIR", path("tmp").c_str(), 1);
  const auto folders = [&] { return std::distance(fs::directory_iterator(path("tmp")), {}); };
  const std::string zip = zipped({{"dem.tif", tiff_}});
  {
    const auto one = must_open(zip, plain_options(), Trust::posted_file, "dem.zip"),
               other = must_open(zip, plain_options(), Trust::posted_file, "dem.zip");
    EXPECT_EQ(folders(), 1);
  }
  Spec flat = hills();
  flat.value = [](int, int) { return 7; };
  zip_bytes(zip, {{"dem.tif", bytes_of(write(flat, "flat.tif"))}, {"README", "longer"}});
  const auto changed = must_open(zip, plain_options(), Trust::posted_file, "dem.zip");
  ASSERT_TRUE(changed);
  EXPECT_NEAR(changed->sample(lattice(8), changed->window(lattice(8)).west + 5, changed->window(lattice(8)).south + 5, 1, 1)
                      .value()
                      .height[0] *
                  proto::kHeightStep_m,
              7, 0.01);
  constexpr int kMostKept = 64;
  for (int k = 0; k < kMostKept + 10; ++k)
    must_open(zipped({{"dem.tif", tiff_}}), plain_options(), Trust::posted_file, "dem.zip");
  EXPECT_LE(folders(), kMostKept + 1) << "and that of the one that is open";
  usual != nullptr ? setenv("TMPDIR", before.c_str(), 1) : unsetenv("TMPDIR");
}

/// Threads that want one archive get one copy of it, while others have theirs made.
TEST_F(Archive, CopiesOfSeveralArchivesAtATime) {
  ASSERT_TRUE(good_);
  const std::vector<std::string> zips{zipped({{"a.tif", tiff_}}), zipped({{"b.tif", tiff_}}), zipped({{"c.tif", tiff_}})};
  constexpr std::size_t kAsked = 24;
  std::vector<std::future<std::string>> asked;
  for (std::size_t k = 0; k < kAsked; ++k)
    asked.push_back(std::async(std::launch::async, [&zips, k] {
      const auto copy = raster::at_hand(zips[k % zips.size()], "dem.zip", Trust::operator_file);
      return copy.ok() ? copy->path : copy.problem().line();
    }));
  std::vector<std::string> paths;
  for (auto& one : asked) paths.push_back(one.get());
  for (std::size_t k = 0; k < kAsked; ++k) EXPECT_EQ(paths[k], paths[k % zips.size()]);
  EXPECT_EQ(std::set<std::string>(paths.begin(), paths.end()).size(), zips.size());
  // Who waited is told, too, why there is none.
  const std::string broken = zipped({{"inner.zip", bytes_of(zips.front())}});
  std::vector<std::future<bool>> refused;
  for (int k = 0; k < 8; ++k)
    refused.push_back(
        std::async(std::launch::async, [&] { return raster::at_hand(broken, "dem.zip", Trust::operator_file).ok(); }));
  for (auto& one : refused) EXPECT_FALSE(one.get());
}

/// Points are read once: whoever opens them again gets the copy, and another file under the name is another.
TEST_F(Archive, PointsAreReadOnce) {
  proto::BuildOptions options = plain_options();
  options.set_crs("EPSG:4326");
  std::string points;
  for (int r = 0; r < 300; ++r)
    for (int c = 0; c < 300; ++c) points += std::to_string(100 + c) + "e-1 " + std::to_string(450 - r) + "e-1 7\n";
  const std::string file = write_text(points, "dem.xyz");
  const auto one = must_open(file, options);
  const auto time = fs::last_write_time(file);
  write_text(std::string(points.size(), 'x'), "dem.xyz");
  fs::last_write_time(file, time);  // as if it had not changed: nobody reads it
  const auto other = must_open(file, options);
  ASSERT_TRUE(one && other);
  EXPECT_EQ(other->description().SerializeAsString(), one->description().SerializeAsString());
  fs::last_write_time(file, time + std::chrono::seconds(1));
  EXPECT_EQ(problem_type(file, options), "raster-format-unsupported");
}

/// Its header can name the file of its heights.
TEST_F(Archive, AnErsHeaderNamesNoFile) {
  Spec spec = hills();
  spec.driver = "ERS";
  std::string header = bytes_of(write(spec, "dem.ers"));
  const std::string data = bytes_of(path("dem"));
  proto::BuildOptions options = plain_options();
  options.set_crs("EPSG:4326");
  EXPECT_TRUE(open(zipped({{"dem.ers", header}, {"dem", data}}), options, Trust::posted_file, "dem.zip").ok());
  header.insert(header.find('\n') + 1,
                "\tDataFile = \"../" + fs::path(path("dem")).parent_path().filename().string() + "/dem\"\n");
  EXPECT_TRUE(open(zipped({{"dem.ers", header}, {"dem", data}}), options, Trust::operator_file, "dem.zip").ok())
      << "the test tests nothing";
  EXPECT_EQ(problem_type(zipped({{"dem.ers", header}, {"dem", data}}), options, Trust::posted_file, "dem.zip"),
            "raster-format-unsupported");
}

}  // namespace
}  // namespace cordillera::raster_test
