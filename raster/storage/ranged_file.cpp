#include "raster/storage/ranged_file.h"

#include <cpl_vsi.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "raster/disk/descriptor.h"
#include "raster/disk/write_all.h"
#include "raster/gdal/formats.h"

namespace cordillera::raster {
namespace {

constexpr const char* kRangedPrefix = "/vsicordillera/";

struct OneRanged {
  RangedFile file;
  std::size_t number = 0;
  std::uint64_t size = 0;
  std::string name;        ///< for GDAL
  std::vector<bool> here;  ///< blocks that were asked for
};

struct AllRanged {
  std::vector<std::unique_ptr<OneRanged>> files;
  std::map<std::string, OneRanged*> by_name, by_path;  ///< GDAL calls back without the prefix
  std::string vrt, vrt_state;
  AskRanges ask;
  std::mutex mutex;  ///< of asks, and of here
};

/// Null: every file is here.
std::unique_ptr<AllRanged> g_ranged;

/// Has the blocks of these ranges come, as many at once as may be asked for.
void have_come(OneRanged& file, std::span<const ByteRange> ranges) {
  if (file.file.whole) return;
  const std::lock_guard lock(g_ranged->mutex);
  file.here.resize(file.size / kRangeBlock_bytes + 1);  // of those that are read
  std::vector<ByteRange> asked;
  std::uint64_t bytes = 0;
  const auto ask = [&] {
    if (!asked.empty()) g_ranged->ask(file.number, asked);
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

/// A place in a file, for one who opened it.
struct RangedCursor {
  RangedCursor(OneRanged& of, Descriptor opened) : file(of), descriptor(std::move(opened)) {}
  OneRanged& file;
  Descriptor descriptor;
  std::uint64_t at = 0;
  bool at_end = false;
};

/// Within the file.
bool read_there(const RangedCursor& cursor, void* out, std::uint64_t first, std::size_t count) {
  return read_all_at(cursor.descriptor.number(), {static_cast<char*>(out), count}, first);
}

OneRanged* ranged_by_name(const char* name) {
  const auto found = g_ranged->by_name.find(name);
  return found == g_ranged->by_name.end() ? nullptr : found->second;
}

int stat_ranged(void*, const char* name, VSIStatBufL* found, int) {
  const OneRanged* const file = ranged_by_name(name);
  if (file == nullptr) return -1;
  std::memset(found, 0, sizeof *found);
  found->st_size = static_cast<decltype(found->st_size)>(file->size);
  found->st_mode = S_IFREG | S_IRUSR;
  return 0;
}

bool is_vrt_there() { return !g_ranged->vrt.empty(); }

/// As GDAL sees it: the word may stand anywhere in the first bytes. What a VRT in a VRT names was looked at by nobody.
bool begins_as_vrt(const RangedCursor& cursor) {
  const ByteRange head{0, std::min<std::uint64_t>(cursor.file.size, kRangeBlock_bytes)};
  std::string bytes(head.count, '\0');
  have_come(cursor.file, {&head, 1});
  return !read_there(cursor, bytes.data(), 0, bytes.size()) || bytes.find("<VRTDataset") != bytes.npos;
}

void* open_ranged(void*, const char* name, const char* access) {
  OneRanged* const file = ranged_by_name(name);
  if (file == nullptr || std::strpbrk(access, "wa+") != nullptr) return nullptr;
  auto cursor = std::make_unique<RangedCursor>(*file, Descriptor(open(file->file.path.c_str(), O_RDONLY | O_CLOEXEC)));
  if (!cursor->descriptor.is_open() || (is_vrt_there() && begins_as_vrt(*cursor))) return nullptr;
  return cursor.release();
}

vsi_l_offset tell_ranged(void* file) { return static_cast<RangedCursor*>(file)->at; }

int seek_ranged(void* file, vsi_l_offset offset, int whence) {
  RangedCursor& cursor = *static_cast<RangedCursor*>(file);
  cursor.at = offset + (whence == SEEK_CUR ? cursor.at : whence == SEEK_END ? cursor.file.size : 0);
  cursor.at_end = false;
  return 0;
}

std::size_t read_ranged(void* file, void* out, std::size_t size, std::size_t count) {
  RangedCursor& cursor = *static_cast<RangedCursor*>(file);
  const std::uint64_t left = cursor.file.size - std::min(cursor.at, cursor.file.size);
  const std::size_t whole = size == 0 ? 0 : static_cast<std::size_t>(std::min<std::uint64_t>(count, left / size));
  cursor.at_end = whole < count;
  const ByteRange range{cursor.at, whole * size};
  if (range.count == 0) return 0;
  have_come(cursor.file, {&range, 1});
  if (!read_there(cursor, out, range.first, range.count)) return 0;
  cursor.at += range.count;
  return whole;
}

int read_ranges(void* file, int count, void** outs, const vsi_l_offset* offsets, const std::size_t* sizes) {
  const RangedCursor& cursor = *static_cast<RangedCursor*>(file);
  std::vector<ByteRange> ranges;
  for (int k = 0; k < count; ++k) {
    if (offsets[k] > cursor.file.size || sizes[k] > cursor.file.size - offsets[k]) return -1;
    if (sizes[k] > 0) ranges.push_back({offsets[k], sizes[k]});
  }
  std::sort(ranges.begin(), ranges.end(), [](const ByteRange& a, const ByteRange& b) { return a.first < b.first; });
  have_come(cursor.file, ranges);
  for (int k = 0; k < count; ++k)
    if (!read_there(cursor, outs[k], offsets[k], sizes[k])) return -1;
  return 0;
}

int ranged_at_end(void* file) { return static_cast<RangedCursor*>(file)->at_end ? 1 : 0; }

int close_ranged(void* file) {
  delete static_cast<RangedCursor*>(file);
  return 0;
}

}  // namespace

bool read_by_ranges(RangedFiles files) {
  auto all = std::make_unique<AllRanged>();
  all->vrt = std::move(files.vrt);
  all->vrt_state = std::move(files.vrt_state);
  if (!all->vrt.empty()) keep_drivers_of_anybody();
  all->ask = std::move(files.ask);
  for (RangedFile& one : files.files) {
    struct stat found {};
    if (stat(one.path.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) return false;
    auto file = std::make_unique<OneRanged>();
    file->file = std::move(one);
    file->number = all->files.size();
    file->size = static_cast<std::uint64_t>(found.st_size);
    file->name = name_for_gdal(file->number, file->file.name);
    all->by_name[file->name.substr(std::strlen(kRangedPrefix))] = file.get();
    if (!file->file.whole) all->by_path[file->file.path] = file.get();
    all->files.push_back(std::move(file));
  }
  g_ranged = std::move(all);
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
  if (!g_ranged) return nullptr;
  const auto found = g_ranged->by_path.find(path);
  return found == g_ranged->by_path.end() ? nullptr : &found->second->file;
}

const std::string& state_of_vrt() { return g_ranged->vrt_state; }

bool is_vrt_of_ranged_files(const std::string& path) { return g_ranged && !path.empty() && g_ranged->vrt == path; }

std::string name_for_gdal(std::size_t file, const std::string& name) { return kRangedPrefix + std::to_string(file) + "/" + name; }

std::string name_for_gdal(const RangedFile& file) { return g_ranged->by_path.at(file.path)->name; }

}  // namespace cordillera::raster
