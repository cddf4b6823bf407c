// Rasters that are fetched as they are read: what is asked for comes, nothing else does, and hosts that say other things than
// they should are told so.
#include "server/fetch/ranged_source.h"

#include <gtest/gtest.h>

#include <tuple>

#include "server/datasets/dataset_folder.h"
#include "server/fetch/fetch.h"
#include "server/fetch/listed_rasters.h"
#include "tests/server/fixture.h"
#include "tests/server/raster_host.h"

namespace cordillera::server::updates {
namespace {

using Parts = RasterHost::Parts;
constexpr std::uint64_t kBlock = kRangeBlock_bytes;

/// Begins as a TIFF does.
std::string raster_of(std::size_t count, char seed) {
  std::string bytes(count, '\0');
  for (std::size_t k = 0; k < count; ++k) bytes[k] = static_cast<char>(seed + k % 251);
  return bytes.replace(0, 4, std::string("II*\0", 4));
}

class Ranged : public testing::Test {
 protected:
  Ranged() { settings_.source_allow = {host_.address() + "/dems/"}; }
  /// Fetches what is fetched of it before it is read.
  Print begin(const std::string& target, const std::atomic<bool>& stop = kNever) {
    target_ = target;
    const auto print = fetcher(settings_, space_).beginning(host_.address() + target, file_, stop);
    EXPECT_TRUE(print) << print.problem().detail;
    return print ? *print : Print();
  }
  std::unique_ptr<RangedSource> open(const Print& print) {
    auto source = fetcher(settings_, space_).rest({host_.address() + target_, file_, print}, talk_);
    return source ? std::move(*source) : nullptr;
  }
  /// What came of it: "", or the problem's name.
  std::string have(RangedSource& source, std::uint64_t first, std::uint64_t count) {
    const raster::ByteRange range{first, count};
    const auto done = source.have(
        {&range, 1}, [this] { return stop_.load(); }, [] {});
    said_ = done ? "" : done.problem().detail;
    return done ? "" : done.problem().type;
  }
  /// Whether these bytes of the file are the raster's.
  bool are_there(std::uint64_t first, std::uint64_t count) {
    return file_text(file_).substr(first, count) == bytes_.substr(first, count);
  }

  inline static const std::atomic<bool> kNever{false};
  const TempFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "raster.tif";
  const std::string bytes_ = raster_of(40 * kBlock + 1000, 'a');
  RasterHost host_;
  ServeSettings settings_;
  limits::Space space_{[] { return std::nullopt; }, 5};
  std::atomic<bool> stop_{false};
  HttpTalk talk_;
  std::string target_, said_;
};

TEST_F(Ranged, OnlyWhatIsAskedForComesAndOnlyOnce) {
  host_.leads("/dems/a.tif", "b.tif");
  host_.has_parts("/dems/b.tif", bytes_, "\"one\"");
  const Print print = begin("/dems/a.tif");
  EXPECT_TRUE(print.ranged);
  EXPECT_EQ(print.bytes, bytes_.size());
  EXPECT_EQ(host_.sent(), kBlock);
  const auto source = open(print);
  ASSERT_TRUE(source);
  EXPECT_EQ(have(*source, 0, 100), "");
  EXPECT_EQ(host_.sent(), kBlock) << "the beginning is there";
  EXPECT_EQ(have(*source, 20 * kBlock - 1, 2), "");
  EXPECT_EQ(host_.sent(), 3 * kBlock);
  EXPECT_TRUE(are_there(19 * kBlock, 2 * kBlock));
  EXPECT_EQ(file_text(file_).substr(5 * kBlock, kBlock), std::string(kBlock, '\0'));
  EXPECT_EQ(have(*source, 40 * kBlock, 1000), "") << "the last block is shorter";
  EXPECT_EQ(host_.sent(), 3 * kBlock + 1000);
  EXPECT_EQ(std::filesystem::file_size(file_), bytes_.size());
  const std::vector<std::string> all = host_.asked();
  EXPECT_EQ(std::count(all.begin(), all.end(), "/dems/a.tif"), 2) << "where it leads is remembered";
}

TEST_F(Ranged, WhoReadsOnGetsMoreAtOnce) {
  host_.has_parts("/dems/a.tif", bytes_, "\"one\"");
  const auto source = open(begin("/dems/a.tif"));
  const auto before = host_.asked().size();
  for (std::uint64_t block = 1; block < 32; ++block) EXPECT_EQ(have(*source, block * kBlock, kBlock), "");
  EXPECT_LE(host_.asked().size() - before, 6u);
  EXPECT_TRUE(are_there(0, 32 * kBlock));
}

TEST_F(Ranged, WhatWasNotedIsThereAgain) {
  host_.has_parts("/dems/a.tif", bytes_, "\"one\"");
  const Print print = begin("/dems/a.tif");
  open(print).reset();
  auto source = open(print);
  EXPECT_EQ(have(*source, 7 * kBlock, 1), "");
  const std::string map = file_text(map_of(file_));
  EXPECT_EQ(map[0], 1) << "what is written may not be on the disk yet";
  source.reset();
  EXPECT_EQ(file_text(map_of(file_))[0], static_cast<char>(1 | 1 << 7));
  source = open(print);
  const auto sent = host_.sent();
  EXPECT_EQ(have(*source, 7 * kBlock, kBlock), "");
  EXPECT_EQ(host_.sent(), sent);
  source.reset();
  std::filesystem::resize_file(map_of(file_), 1);
  EXPECT_FALSE(open(print)) << "of another raster";
  std::filesystem::remove(map_of(file_));
  EXPECT_FALSE(open(print));
}

TEST_F(Ranged, AnotherRasterIsNoticed) {
  host_.has_parts("/dems/a.tif", bytes_, "\"one\"");
  const auto source = open(begin("/dems/a.tif"));
  EXPECT_EQ(have(*source, 3 * kBlock, 1), "");
  host_.has_parts("/dems/a.tif", raster_of(bytes_.size(), 'b'), "\"two\"");
  EXPECT_EQ(have(*source, 9 * kBlock, 1), "source-replaced");
  EXPECT_EQ(have(*source, 3 * kBlock, 1), "") << "what is there is of the first";
  host_.has_parts("/dems/a.tif", bytes_, "\"one\"", Parts::other_size);
  EXPECT_EQ(have(*source, 9 * kBlock, 1), "source-replaced");
  host_.has_no_more("/dems/a.tif");
  EXPECT_EQ(have(*source, 9 * kBlock, 1), "source-unreachable");
  host_.leads("/dems/a.tif", "/private/a.tif");
  EXPECT_EQ(have(*source, 9 * kBlock, 1), "option-forbidden");
  host_.has_parts("/dems/a.tif", bytes_, "\"one\"");
  EXPECT_EQ(have(*source, 9 * kBlock, 1), "");
  EXPECT_TRUE(are_there(9 * kBlock, kBlock));
}

TEST_F(Ranged, NothingOfAWrongAnswerIsKept) {
  for (const auto& [parts, slug, why] : {std::tuple{Parts::elsewhere, "source-unreachable", "another part"},
                                         {Parts::cut, "source-unreachable", "broke off after"},
                                         {Parts::not_after_the_first, "source-replaced", "dems/a.tif"},
                                         {Parts::endless, "source-unreachable", "more than was asked"}}) {
    host_.has_parts("/dems/a.tif", bytes_, "\"one\"", parts);
    const auto source = open(begin("/dems/a.tif"));
    ASSERT_TRUE(source) << why;
    EXPECT_EQ(have(*source, 5 * kBlock, 1), slug) << why;
    EXPECT_NE(said_.find(why), std::string::npos) << said_;
    EXPECT_EQ(file_text(file_).substr(5 * kBlock, kBlock), std::string(kBlock, '\0')) << why;
  }
  EXPECT_LT(host_.sent(), 4 * bytes_.size());
}

TEST_F(Ranged, WhoHangsIsLeftWhenTheJobEnds) {
  host_.has_parts("/dems/a.tif", bytes_, "\"one\"", Parts::hanging);
  const auto source = open(begin("/dems/a.tif"));
  const auto before = host_.asked().size();
  std::thread ends([&] {
    while (host_.asked().size() == before) std::this_thread::yield();
    stop_ = true;
  });
  EXPECT_EQ(have(*source, 5 * kBlock, 1), "cancelled");
  ends.join();
}

TEST_F(Ranged, WithoutPartsAllOfItIsCopied) {
  for (const Parts parts : {Parts::none, Parts::without_total, Parts::untagged, Parts::in_full}) {
    host_.has_parts("/dems/a.tif", bytes_, "\"one\"", parts);
    const Print print = begin("/dems/a.tif");
    EXPECT_FALSE(print.ranged);
    EXPECT_TRUE(file_text(file_) == bytes_);
    EXPECT_FALSE(std::filesystem::exists(map_of(file_)));
  }
  for (const std::string& other : {std::string(3 * kBlock, 'z'), bytes_.substr(0, 1000)}) {
    host_.has_parts("/dems/a.zip", other, "\"one\"");
    EXPECT_FALSE(begin("/dems/a.zip").ranged) << "no TIFF, or too small";
    EXPECT_TRUE(file_text(file_) == other);
  }
}

TEST_F(Ranged, AJobIsNotTrusted) {
  host_.has_parts("/dems/a.tif", bytes_, "\"one\"");
  const Print print = begin("/dems/a.tif");
  auto source = open(print);
  const auto asked = host_.asked().size();
  for (const auto& [first, count] : {std::pair<std::uint64_t, std::uint64_t>{bytes_.size(), 1},
                                     {0, ~std::uint64_t{0}},
                                     {~std::uint64_t{0}, 2},
                                     {1, raster::kMostAsked_bytes + 1}})
    EXPECT_EQ(have(*source, first, count), "internal") << first << " " << count;
  EXPECT_EQ(host_.asked().size(), asked);
  source.reset();
  std::filesystem::rename(file_, folder_.path() / "other");
  std::filesystem::create_symlink(folder_.path() / "other", file_);
  EXPECT_FALSE(open(print)) << "a link could lead anywhere";
}

TEST_F(Ranged, MoreThanARasterMayHaveIsNotFetched) {
  settings_.limits.body_mib = 1;
  host_.has_parts("/dems/a.tif", bytes_, "\"one\"");
  const auto source = open(begin("/dems/a.tif"));
  EXPECT_EQ(have(*source, kBlock, 15 * kBlock), "");
  EXPECT_EQ(have(*source, 30 * kBlock, 1), "body-too-large");
}

/// More of them than are open at a time, and some that are there as a whole.
TEST_F(Ranged, OfManyRastersEachComesFromItsAddress) {
  constexpr std::size_t kCount = 40, kWhole = 7;
  std::vector<RangedSource::Place> places;
  for (std::size_t k = 0; k < kCount; ++k) {
    const std::string target = "/dems/" + std::to_string(k) + ".tif";
    host_.has_parts(target, raster_of(3 * kBlock, static_cast<char>('a' + k % 8)), "\"" + std::to_string(k) + "\"");
    const auto file = folder_.path() / (std::to_string(k) + ".tif");
    const auto print = fetcher(settings_, space_).beginning(host_.address() + target, file, kNever);
    ASSERT_TRUE(print);
    places.push_back({host_.address() + target, file, *print});
  }
  places[kWhole].print.ranged = false;
  RangedSources sources(fetcher(settings_, space_).rest, places, [](auto) {});
  const auto asked = [&](std::uint64_t number, std::uint64_t block) {
    const raster::ByteRange range{block * kBlock, kBlock};
    const auto done = sources.have(number, {&range, 1}, [] { return false; });
    return done ? "" : done.problem().type;
  };
  for (const std::uint64_t block : {std::uint64_t{1}, std::uint64_t{2}, std::uint64_t{1}})
    for (std::size_t k = 0; k < kCount; ++k) EXPECT_EQ(asked(k, block), k == kWhole ? "internal" : "");
  for (std::size_t k = 0; k < kCount; ++k)
    EXPECT_EQ(file_text(places[k].file) == raster_of(3 * kBlock, static_cast<char>('a' + k % 8)), k != kWhole) << k;
  EXPECT_EQ(host_.sent(), (kCount * 3 - 2) * kBlock) << "each block once";
  for (const std::uint64_t none : {std::uint64_t{kCount}, ~std::uint64_t{0}}) EXPECT_EQ(asked(none, 1), "internal");
}

TEST(ListedRasters, AddressesCountFromTheirList) {
  const std::string list = "https://h.example/a/list.json?sig=1";
  EXPECT_EQ(listed_address(list, "b/c.tif"), "https://h.example/a/b/c.tif");
  EXPECT_EQ(listed_address(list, "../c.tif?x=2"), "https://h.example/c.tif?x=2");
  EXPECT_EQ(listed_address(list, "/c.tif"), "https://h.example/c.tif");
  EXPECT_EQ(listed_address(list, "/vsicurl/http://o.example/c.tif"), "http://o.example/c.tif");
  EXPECT_EQ(listed_address(list, "/vsis3/bucket/c.tif"), "s3://bucket/c.tif");
  EXPECT_EQ(listed_address("s3://bucket/a/list.vrt", "b.tif"), "s3://bucket/a/b.tif");
  EXPECT_EQ(listed_name("https://h.example/a/c.tif?sig=secret"), "c.tif");
  EXPECT_EQ(listed_name("a/c.tif;sig=secret"), "c.tif");
  for (const char* none : {"", "a/", "..", "a/.?x"}) EXPECT_EQ(listed_name(none), "raster") << none;
}

TEST(ListedRasters, ANoteIsReadAsItWasWrittenAndNoOther) {
  const TempFolder folder;
  EXPECT_FALSE(read_listed(folder.path()));
  proto::ListedRasters listed;
  listed.set_vrt(true);
  proto::ListedRaster& first = *listed.add_rasters();
  first.set_address("https://h.example/a.tif?x=1");
  first.set_name("a.tif");
  first.mutable_options()->set_nodata("-1");
  set_print({"\"t\"", "", 70000, true}, first);
  listed.add_rasters()->set_name("c");
  ASSERT_TRUE(write_listed(folder.path(), listed));
  const auto read = read_listed(folder.path());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->rasters(0).SerializeAsString(), first.SerializeAsString());
  EXPECT_EQ(print_of(read->rasters(0)).bytes, 70000u);
  EXPECT_EQ(file_of(*read, 0), "0.tif");
  EXPECT_EQ(file_of(*read, 1), "1");
  const std::string state = state_of(first);
  first.set_etag("\"u\"\r\nX: 1");
  EXPECT_NE(state_of(first), state);
  EXPECT_EQ(print_of(first).etag, "") << "no header has that";
  for (const std::string& other : {std::string(), std::string("[]"), std::string(R"({"rasters": [3]})"),
                                   std::string(R"({"rasters": 7})"), "{\"rasters\": " + std::string(1 << 20, '[')}) {
    std::ofstream(folder.path() / kListedFile) << other;
    EXPECT_FALSE(read_listed(folder.path())) << other.substr(0, 40);
  }
  std::filesystem::resize_file(folder.path() / kListedFile, std::uintmax_t{1} << 30);
  EXPECT_FALSE(read_listed(folder.path())) << "longer than any of ours";
}

TEST(ContentRange, IsReadAsItIsWritten) {
  const auto range = read_content_range("bytes 100-199/1000");
  ASSERT_TRUE(range);
  EXPECT_EQ(std::tuple(range->first, range->count, range->total), std::tuple(100u, 100u, 1000u));
  for (const char* wrong : {"", "bytes 0-9/*", "bytes */10", "bytes 5-4/10", "bytes 0-10/10", "bytes -1-2/10", "bytes 0-1/10 ",
                            "items 0-1/10", "bytes 0-1", "bytes 0-99999999999999999999/1"})
    EXPECT_FALSE(read_content_range(wrong)) << wrong;
}

TEST(ContentRange, OfMoreThanAMapIsKeptForIsNotBegun) {
  Got head;
  head.status = 206;
  head.etag = "\"one\"";
  for (const auto& [total, is_begun] :
       {std::pair{"70000", true}, {"1099511627776", true}, {"4398046511105", false}, {"1125899906842624", false}}) {
    head.range = std::string("bytes 0-65535/") + total;
    EXPECT_EQ(can_be_ranged(head), is_begun) << total;
  }
}

}  // namespace
}  // namespace cordillera::server::updates
