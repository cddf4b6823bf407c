#pragma once
// A raster at an address of which only what is asked for is fetched, into a file of its size that is empty elsewhere. Beside the
// file lies a map of what is there, a bit a block.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/result.h"
#include "raster/disk/descriptor.h"
#include "raster/storage/ranged_file.h"
#include "server/data/layout.h"
#include "server/fetch/http_get.h"
#include "server/fetch/print.h"
#include "server/limits/space.h"
#include "server/options/options.h"

namespace cordillera::server::updates {

using raster::kRangeBlock_bytes;

/// "bytes 0-99/1000": what a part is of. nullopt: it is not said, or not so.
struct ContentRange {
  std::uint64_t first = 0, count = 0, total = 0;
};
std::optional<ContentRange> read_content_range(const std::string& text);

inline constexpr std::uint64_t kLargestRanged_bytes = std::uint64_t{1} << 42;  ///< its map has 8 MiB: a source may say any number

/// Whether a part that was sent can be the beginning of a raster that is fetched by ranges: all is known to tell later that it is
/// still the same.
bool can_be_ranged(const Got& head);
/// Whether it is a TIFF by its first bytes: other formats have what opens them at their end, or all over.
bool begins_as_tiff(std::string_view bytes);
/// The file with its beginning becomes one of the whole size, with its map. Problems: "storage-full", "body-too-large".
proto::Result<void> begin_ranged(const std::filesystem::path& file, std::uint64_t begun_bytes, std::uint64_t bytes);

/// One thread's.
class RangedSource {
 public:
  struct Place {
    std::string address;
    std::filesystem::path file;
    Print print;  ///< what is in the file is of this
  };
  /// Problem: "source-replaced", the file or its map is not there or not of this print.
  /// talk: outlives it; what is asked for goes by that.
  static proto::Result<std::unique_ptr<RangedSource>> open(const ServeSettings& settings, limits::Space& space, HttpTalk& talk,
                                                           Place place);
  ~RangedSource();
  RangedSource(const RangedSource&) = delete;
  RangedSource& operator=(const RangedSource&) = delete;

  /// Has them in the file. Whoever asks is not trusted. Problems: "source-unreachable", "source-replaced", "option-forbidden" (a
  /// redirect), "body-too-large" (more was fetched than a raster may have), "storage-full", "cancelled"; "internal": there are no
  /// such bytes, or too many at once. came: after each request, which is what takes time.
  proto::Result<void> have(std::span<const raster::ByteRange> ranges, const std::function<bool()>& stopped,
                           const std::function<void()>& came);
  /// What came since the last note is noted on disk, after it is there: a block that was cut off is never taken for whole.
  void note();

 private:
  struct Run {
    std::uint64_t first = 0, count = 0;  ///< blocks
  };
  RangedSource(const ServeSettings& settings, limits::Space& space, HttpTalk& talk, Place place);
  std::vector<Run> missing(std::span<const raster::ByteRange> ranges) const;
  bool is_here(std::uint64_t block) const { return (map_[block / 8] >> (block % 8) & 1) != 0; }
  void mark(const Run& run);
  proto::Result<void> fetch(const Run& run, const std::function<bool()>& stopped);
  struct Answer;
  Answer ask(const Run& run, const Terms& terms);
  proto::Result<void> keep(const Run& run, const std::string& bytes);
  proto::Problem changed() const;

  const ServeSettings settings_;
  const Place place_;
  std::string full_;  ///< why there is no room; before claim_, which may fill it
  const std::unique_ptr<limits::Space::Claim> claim_;
  HttpTalk& talk_;
  std::string at_;  ///< what is asked for: where the address led to last, or an object's signed address
  raster::Descriptor file_, map_file_;
  std::string map_;
  bool noted_ = true, lost_ = false;  ///< the map is on disk; the disk has lost what was written
  std::uint64_t here_ = 0;            ///< blocks
  Run last_;
};

}  // namespace cordillera::server::updates
