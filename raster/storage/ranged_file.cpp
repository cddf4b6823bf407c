#include "raster/storage/ranged_file.h"

#include <cpl_vsi.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <mutex>
#include <vector>

#include "raster/disk/write_all.h"

namespace cordillera::raster {
namespace {

constexpr const char* kRangedPrefix = "/vsicordillera/";

struct OpenRanged {
  RangedFile file;
  int descriptor = -1;
  std::uint64_t size = 0;
  std::mutex mutex;
  std::vector<bool> here;  ///< blocks that were asked for
};

/// Null: every file is here.
std::unique_ptr<OpenRanged> g_ranged;

/// Has the blocks of these ranges come, as many at once as may be asked for.
void have_come(std::span<const ByteRange> ranges) {
  OpenRanged& file = *g_ranged;
  const std::lock_guard lock(file.mutex);
  std::vector<ByteRange> asked;
  std::uint64_t bytes = 0;
  const auto ask = [&] {
    if (!asked.empty()) file.file.ask(asked);
    for (const ByteRange& range : asked) {
      for (std::uint64_t at = range.first; at < range.first + range.count; at += kRangeBlock_bytes)
        file.here[at / kRangeBlock_bytes] = true;
    }
    asked.clear();
    bytes = 0;
  };
  for (const ByteRange& range : ranges) {
    const std::uint64_t end = std::min(range.first + range.count, file.size);
    for (std::uint64_t at = range.first / kRangeBlock_bytes * kRangeBlock_bytes; at < end; at += kRangeBlock_bytes) {
      const std::uint64_t count = std::min(kRangeBlock_bytes, file.size - at);
      if (file.here[at / kRangeBlock_bytes]) continue;
      if (bytes + count > kMostAsked_bytes) ask();
      if (!asked.empty() && at < asked.back().first + asked.back().count && at >= asked.back().first)
        continue;  // two ranges share it
      if (!asked.empty() && at == asked.back().first + asked.back().count) {
        asked.back().count += count;
      } else {
        if (asked.size() == kMostRanges) ask();
        asked.push_back({at, count});
      }
      bytes += count;
    }
  }
  ask();
}

/// Within the file.
bool read_there(void* out, std::uint64_t first, std::size_t count) {
  return read_all_at(g_ranged->descriptor, {static_cast<char*>(out), count}, first);
}

/// A place in the file, for one who opened it.
struct RangedCursor {
  std::uint64_t at = 0;
  bool at_end = false;
};

int stat_ranged(void*, const char* name, VSIStatBufL* found, int) {
  if (name != g_ranged->file.name) return -1;
  std::memset(found, 0, sizeof *found);
  found->st_size = static_cast<decltype(found->st_size)>(g_ranged->size);
  found->st_mode = S_IFREG | S_IRUSR;
  return 0;
}

void* open_ranged(void*, const char* name, const char* access) {
  return name != g_ranged->file.name || std::strpbrk(access, "wa+") != nullptr ? nullptr : new RangedCursor;
}

vsi_l_offset tell_ranged(void* file) { return static_cast<RangedCursor*>(file)->at; }

int seek_ranged(void* file, vsi_l_offset offset, int whence) {
  RangedCursor& cursor = *static_cast<RangedCursor*>(file);
  cursor.at = offset + (whence == SEEK_CUR ? cursor.at : whence == SEEK_END ? g_ranged->size : 0);
  cursor.at_end = false;
  return 0;
}

std::size_t read_ranged(void* file, void* out, std::size_t size, std::size_t count) {
  RangedCursor& cursor = *static_cast<RangedCursor*>(file);
  const std::uint64_t left = g_ranged->size - std::min(cursor.at, g_ranged->size);
  const std::size_t whole = size == 0 ? 0 : static_cast<std::size_t>(std::min<std::uint64_t>(count, left / size));
  cursor.at_end = whole < count;
  const ByteRange range{cursor.at, whole * size};
  if (range.count == 0) return 0;
  have_come({&range, 1});
  if (!read_there(out, range.first, range.count)) return 0;
  cursor.at += range.count;
  return whole;
}

int read_ranges(void*, int count, void** outs, const vsi_l_offset* offsets, const std::size_t* sizes) {
  std::vector<ByteRange> ranges;
  for (int k = 0; k < count; ++k) {
    if (offsets[k] > g_ranged->size || sizes[k] > g_ranged->size - offsets[k]) return -1;
    if (sizes[k] > 0) ranges.push_back({offsets[k], sizes[k]});
  }
  std::sort(ranges.begin(), ranges.end(), [](const ByteRange& a, const ByteRange& b) { return a.first < b.first; });
  have_come(ranges);
  for (int k = 0; k < count; ++k)
    if (!read_there(outs[k], offsets[k], sizes[k])) return -1;
  return 0;
}

int ranged_at_end(void* file) { return static_cast<RangedCursor*>(file)->at_end ? 1 : 0; }

int close_ranged(void* file) {
  delete static_cast<RangedCursor*>(file);
  return 0;
}

}  // namespace

bool read_by_ranges(RangedFile ranged) {
  auto file = std::make_unique<OpenRanged>();
  file->file = std::move(ranged);
  file->descriptor = open(file->file.path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat found {};
  if (file->descriptor < 0 || fstat(file->descriptor, &found) != 0) return false;
  file->size = static_cast<std::uint64_t>(found.st_size);
  file->here.resize(file->size / kRangeBlock_bytes + 1);
  g_ranged = std::move(file);
  VSIFilesystemPluginCallbacksStruct* const calls = VSIAllocFilesystemPluginCallbacksStruct();
  calls->stat = stat_ranged;
  calls->open = open_ranged;
  calls->tell = tell_ranged;
  calls->seek = seek_ranged;
  calls->read = read_ranged;
  calls->read_multi_range = read_ranges;
  calls->eof = ranged_at_end;
  calls->close = close_ranged;
  const bool installed = VSIInstallPluginHandler(kRangedPrefix, calls) == 0;
  VSIFreeFilesystemPluginCallbacksStruct(calls);
  return installed;
}

const RangedFile* ranged_file(const std::string& path) {
  return g_ranged && g_ranged->file.path == path ? &g_ranged->file : nullptr;
}

std::string name_for_gdal(const RangedFile& file) { return kRangedPrefix + file.name; }

}  // namespace cordillera::raster
