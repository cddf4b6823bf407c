// After github.com/protomaps/PMTiles, spec/v3. A directory's leaves follow it; whatever a damaged file says, reading ends.
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

#include "pipeline/encode/strange_json.h"
#include "pipeline/exports/archive_metadata.h"
#include "pipeline/exports/archive_reader.h"
#include "pipeline/exports/gzip.h"
#include "pipeline/exports/hilbert.h"
#include "pipeline/exports/pmtiles_directory.h"
#include "pipeline/exports/whole_file.h"

namespace cordillera::pipeline::exports {
namespace {

constexpr std::size_t kMostPart = std::size_t{64} << 20;  // of a directory, of the metadata, of a tile
constexpr int kMostDepth = 4;                             // of directories, as the specification has it
// Of directories, each as often as it is named, and of their bytes together. A million tiles have a few hundred, of 20 MiB.
constexpr std::uint64_t kMostDirectories = 20000, kMostOfThem = std::uint64_t{128} << 20;
constexpr std::uint8_t kPlain = 1, kGzipped = 2;

class PmtilesFile final : public ArchiveReader {
 public:
  explicit PmtilesFile(const std::string& path)
      : path_(path), size_(std::filesystem::file_size(path)), file_(path, std::ios::binary) {
    header_ = read(0, kPmtilesHeader);
    if (!header_.starts_with("PMTiles\3")) refuse("it is no PMTiles archive of version 3");
    read_metadata();
  }
  const Json& metadata() const override { return metadata_; }

  std::optional<ArchiveSize> size() override {
    ArchiveSize size;
    PmtilesEntry before;
    each_run([&](const PmtilesEntry& run) {
      size.tiles += run.run;
      if (size.tiles == run.run || !is_same(run, before)) size.bytes += run.length;
      before = run;
    });
    return size;
  }

  std::map<int, std::uint64_t> tiles_by_zoom() override {
    std::map<int, std::uint64_t> tiles;
    each_run([&](const PmtilesEntry& run) {
      for (std::uint64_t id = run.id, end = run.id + run.run; id < end;) {  // a run may go on at the next zoom
        const int zoom = hilbert_address(id).zoom;
        const std::uint64_t until = std::min(end, hilbert_id({zoom + 1, 0, 0}));
        tiles[zoom] += until - id;
        id = until;
      }
    });
    return tiles;
  }

  void each_tile(const Take& take) override {
    PmtilesEntry before;
    std::string bytes;
    bool again = false;
    each_run([&](const PmtilesEntry& run) {
      again = again && is_same(run, before);
      if (!again) bytes = plain(read(sum(number(56), run.offset), run.length), byte(98));
      before = run;
      for (std::uint64_t k = 0; k < run.run; ++k, again = true) take({hilbert_address(run.id + k), bytes, again});
    });
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const { throw Refused{unreadable(path_, why)}; }

  std::string read(std::uint64_t offset, std::uint64_t count) {
    if (offset > size_ || count > size_ - offset) refuse("it is cut short");
    if (count > kMostPart) refuse("a part of it is larger than 64 MiB");
    std::string bytes(count, '\0');
    file_.seekg(static_cast<std::streamoff>(offset));
    if (!file_.read(bytes.data(), static_cast<std::streamsize>(count))) refuse("its disk does not give it");
    return bytes;
  }
  std::string plain(std::string bytes, std::uint8_t compression) const {
    if (compression == kGzipped) {
      auto unpacked = gunzip(bytes, kMostPart);
      if (!unpacked) refuse("it is damaged");
      return std::move(*unpacked);
    }
    // 0 is unknown, which writers of pictures put.
    if (compression > kPlain) refuse("it is compressed with Brotli or Zstandard");
    return bytes;
  }

  std::uint64_t number(std::size_t at, std::size_t bytes = 8) const {
    std::uint64_t value = 0;
    for (std::size_t k = bytes; k-- > 0;) value = value << 8 | byte(at + k);
    return value;
  }
  std::uint8_t byte(std::size_t at) const { return static_cast<std::uint8_t>(header_[at]); }
  double degrees(std::size_t at) const { return static_cast<std::int32_t>(number(at, 4)) / 1e7; }
  std::uint8_t inner() const { return byte(97); }

  void read_metadata() {
    if (number(32) > 0) metadata_ = json_of_stranger(plain(read(number(24), number(32)), inner()));
    if (!metadata_.is_object()) metadata_ = Json::object();
    static constexpr std::array kFormats{"", "pbf", "png", "jpg", "webp", "avif"};
    const std::uint8_t type = byte(99);
    if (type > 0 && type < kFormats.size()) metadata_["format"] = kFormats[type];
    if (number(102) != 0 || number(110) != 0)
      metadata_["bounds"] = with_commas({degrees(102), degrees(106), degrees(110), degrees(114)});
  }

  std::vector<PmtilesEntry> entries(const std::string& text) const {
    std::size_t place = 0;
    const auto varint = [&] {
      std::uint64_t value = 0;
      for (int shift = 0; shift < 64; shift += 7) {
        if (place == text.size()) refuse("a directory is cut short");
        const auto part = static_cast<std::uint8_t>(text[place++]);
        value |= std::uint64_t{part & 127u} << shift;
        if (part < 128) return value;
      }
      refuse("a directory is damaged");
    };
    const std::uint64_t count = varint();
    if (count > text.size() / 4) refuse("a directory is cut short");  // each entry has four numbers
    if (count > kMostArchived) throw Refused{too_many_archived()};
    std::vector<PmtilesEntry> all(count);
    std::uint64_t id = 0;
    for (PmtilesEntry& entry : all) entry.id = id += varint();
    for (PmtilesEntry& entry : all) entry.run = static_cast<std::uint32_t>(varint());
    for (PmtilesEntry& entry : all) entry.length = static_cast<std::uint32_t>(varint());
    for (std::size_t k = 0; k < all.size(); ++k) {
      const std::uint64_t offset = varint();
      if (offset == 0 && k == 0) refuse("a directory is damaged");
      all[k].offset = offset > 0 ? offset - 1 : all[k - 1].offset + all[k - 1].length;
    }
    return all;
  }

  using TakeRun = std::function<void(const PmtilesEntry& run)>;
  static bool is_same(const PmtilesEntry& a, const PmtilesEntry& b) { return a.offset == b.offset && a.length == b.length; }

  void each_run(const TakeRun& take) {
    directories_ = of_them_ = 0;
    walk(plain(read(number(8), number(16)), inner()), kMostDepth, take);
  }

  void walk(const std::string& directory, int depth, const TakeRun& take) {
    const std::uint64_t beyond = hilbert_id({kMostArchiveZoom + 1, 0, 0});
    if (++directories_ > kMostDirectories || (of_them_ += directory.size()) > kMostOfThem)
      refuse("its directories are more than 20,000, or longer than 128 MiB");
    for (const PmtilesEntry& entry : entries(directory)) {
      if (entry.run == 0) {
        if (depth == 0) refuse("its directories are too deep");
        walk(plain(read(sum(number(40), entry.offset), entry.length), inner()), depth - 1, take);
        continue;
      }
      if (entry.id >= beyond || entry.run > beyond - entry.id) refuse("a directory is damaged");
      take(entry);
    }
  }
  std::uint64_t sum(std::uint64_t a, std::uint64_t b) const {
    if (a > size_ || b > size_ - a) refuse("it is cut short");
    return a + b;
  }

  std::string path_;
  std::uint64_t size_;
  std::ifstream file_;
  std::string header_;
  std::uint64_t directories_ = 0, of_them_ = 0;  ///< of this walk: how many, and their bytes
  Json metadata_ = Json::object();
};

}  // namespace

std::unique_ptr<ArchiveReader> open_pmtiles(const std::string& path) { return std::make_unique<PmtilesFile>(path); }

}  // namespace cordillera::pipeline::exports
