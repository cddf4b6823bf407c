#include "raster/storage/object_file.h"

#include <cpl_conv.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <cpl_vsi_virtual.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "raster/gdal/gdal_scope.h"
#include "raster/storage/storage.h"

namespace cordillera::raster {
namespace {

constexpr auto kRest = std::chrono::seconds(1);  // after a failure: those who wait for a storage that hangs would add up

proto::Problem unreadable(const std::string& path, const std::string& why) {
  return {"storage-read", path + " cannot be read" + (why.empty() ? "" : ": " + why), "a file that is there and can be read", ""};
}

struct Version {
  std::uint64_t size = 0;
  std::string state;
};

/// Size and tag from one small read of the object itself: GDAL remembers what it was told before, and must not be asked.
std::optional<Version> version_there(const std::string& path) {
  const CPLStringList headers(VSIGetFileMetadata(path.c_str(), "HEADERS", nullptr));
  if (headers.size() == 0) return std::nullopt;
  const std::string range = headers.FetchNameValueDef("Content-Range", "");  // bytes 0-16383/3000000
  const std::size_t slash = range.rfind('/');
  const std::string bytes =
      slash == std::string::npos ? headers.FetchNameValueDef("Content-Length", "0") : range.substr(slash + 1);
  Version version{std::strtoull(bytes.c_str(), nullptr, 10), ""};
  version.state = bytes + " " + headers.FetchNameValueDef("ETag", "") + " " + headers.FetchNameValueDef("Last-Modified", "");
  return version;
}

std::optional<Version> version_of(const std::string& path) {
  if (is_remote(path)) {
    if (auto version = version_there(path)) return version;
  }
  // A file system that has no headers, or none that answers.
  const auto size = size_of(path);
  if (!size) return std::nullopt;
  return Version{*size, state_of(path)};
}

/// Without it GDAL lists the whole folder before it opens a file of it.
class NoListing {
 public:
  NoListing() { CPLSetThreadLocalConfigOption("GDAL_DISABLE_READDIR_ON_OPEN", "EMPTY_DIR"); }
  ~NoListing() { CPLSetThreadLocalConfigOption("GDAL_DISABLE_READDIR_ON_OPEN", nullptr); }
};

}  // namespace

struct ObjectFile::Handle {
  explicit Handle(const std::string& name) : path(name), file(VSIFOpenL(name.c_str(), "rb")) {}
  ~Handle() {
    if (file != nullptr) VSIFCloseL(file);
  }
  /// At a place, without a cursor that threads would share, and without GDAL's own cache, which knows files by their names.
  bool read(std::uint64_t offset, std::string& bytes) {
    if (is_remote(path)) VSICurlPartialClearCache(path.c_str());  // after a failure GDAL holds that there is no such file
    auto* const whole = reinterpret_cast<VSIVirtualHandle*>(file);
    if (whole->HasPRead()) return whole->PRead(bytes.data(), bytes.size(), offset) == bytes.size();
    const std::lock_guard lock(mutex);
    return VSIFSeekL(file, offset, SEEK_SET) == 0 && VSIFReadL(bytes.data(), 1, bytes.size(), file) == bytes.size();
  }
  const std::string path;
  VSILFILE* const file;
  std::mutex mutex;
};

ObjectFile::ObjectFile(std::string path, std::shared_ptr<BlockCache> cache)
    : path_(std::move(path)), cache_(std::move(cache)), number_(cache_->new_file()) {}

ObjectFile::~ObjectFile() {
  const GdalScope scope(Trust::operator_file);
  handle_.reset();
  cache_->forget(number_);
}

proto::Result<std::shared_ptr<ObjectFile>> ObjectFile::open(const std::string& path, std::shared_ptr<BlockCache> cache) {
  const GdalScope scope(Trust::operator_file);
  const NoListing no_listing;
  const auto version = version_of(path);
  if (!version) return unreadable(path, scope.message("", ""));
  std::shared_ptr<ObjectFile> file(new ObjectFile(path, std::move(cache)));
  file->handle_ = std::make_unique<Handle>(path);
  if (file->handle_->file == nullptr) return unreadable(path, scope.message("", ""));
  file->state_ = version->state;
  file->size_ = version->size;
  return file;
}

proto::Problem ObjectFile::changed() const {
  return {"storage-changed", path_ + " is another file than it was when it was opened", "opening it again", ""};
}

proto::Result<bool> ObjectFile::unchanged() {
  const GdalScope scope(Trust::operator_file);
  const NoListing no_listing;
  const auto now = version_of(path_);
  if (!now) return unreadable(path_, scope.message("", ""));
  const std::lock_guard lock(mutex_);
  if (now->state != state_) changed_ = true;
  return !changed_;
}

proto::Result<BlockCache::Piece> ObjectFile::block(std::uint64_t number) {
  if (auto kept = cache_->find({number_, number})) return kept;
  {
    const std::lock_guard lock(mutex_);
    if (changed_) return changed();
    if (trouble_ && std::chrono::steady_clock::now() - failed_ < kRest) return *trouble_;
  }
  const std::uint64_t offset = number * kBlock_bytes;
  std::string bytes(std::min<std::uint64_t>(kBlock_bytes, size_ - offset), '\0');
  const GdalScope scope(Trust::operator_file);
  const bool whole = handle_->read(offset, bytes);
  const std::string why = scope.message("", "");
  // Only when the name still stands for the same file after the read were the bytes of this one.
  const auto same = unchanged();
  if (same.ok() && !*same) return changed();
  if (!whole) return unreadable(path_, why.empty() ? "it ended early" : why);
  if (!same.ok()) return same.problem();
  auto piece = std::make_shared<const std::string>(std::move(bytes));
  cache_->keep({number_, number}, piece);
  return BlockCache::Piece(piece);
}

proto::Result<void> ObjectFile::read(std::uint64_t offset, std::size_t count, char* out) {
  for (const std::uint64_t end = offset + count; offset < end;) {
    const auto piece = block(offset / kBlock_bytes);
    if (!piece.ok()) return failed(piece.problem());
    const std::size_t from = offset % kBlock_bytes, part = std::min<std::size_t>((*piece)->size() - from, end - offset);
    std::memcpy(out, (*piece)->data() + from, part);
    out += part;
    offset += part;
  }
  return {};
}

proto::Problem ObjectFile::failed(const proto::Problem& problem) {
  const std::lock_guard lock(mutex_);
  if (!trouble_ || std::chrono::steady_clock::now() - failed_ >= kRest) failed_ = std::chrono::steady_clock::now();
  trouble_ = problem;
  return problem;
}

std::optional<proto::Problem> ObjectFile::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

}  // namespace cordillera::raster
