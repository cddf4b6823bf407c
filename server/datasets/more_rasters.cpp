#include "server/datasets/more_rasters.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>

#include "pipeline/exports/zip_writer.h"
#include "raster/disk/descriptor.h"
#include "raster/disk/free_space.h"
#include "raster/disk/write_all.h"
#include "raster/gdal/formats.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

/// A file's bytes where they are: a raster may be larger than memory.
class Mapped {
 public:
  explicit Mapped(const fs::path& file) {
    const raster::Descriptor opened(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
    std::error_code error;
    size_ = !opened.is_open() ? 0 : static_cast<std::size_t>(fs::file_size(file, error));
    if (!error && size_ > 0) memory_ = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, opened.number(), 0);
  }
  ~Mapped() {
    if (memory_ != MAP_FAILED) munmap(memory_, size_);
  }
  Mapped(const Mapped&) = delete;
  Mapped& operator=(const Mapped&) = delete;
  std::optional<std::string_view> bytes() const {
    return memory_ == MAP_FAILED ? std::nullopt : std::optional(std::string_view(static_cast<const char*>(memory_), size_));
  }

 private:
  void* memory_ = MAP_FAILED;
  std::size_t size_ = 0;
};

/// Which of the files each says something of; of a raster, or of none that is there, itself.
std::vector<std::size_t> rasters_of(const std::vector<MoreRaster>& files) {
  std::vector<std::size_t> of(files.size());
  for (std::size_t k = 0; k < files.size(); ++k) {
    of[k] = k;
    for (std::size_t other = 0; other < files.size() && of[k] == k; ++other) {
      const bool raster =
          !raster::is_side_extension(raster::extension_of(files[other].name)) && !raster::is_pam(files[other].name);
      if (raster && !files[k].name.empty() && raster::is_side_of(files[other].name, files[k].name)) of[k] = other;
    }
  }
  return of;
}

proto::Problem unwritten() {
  return {"storage-full", "a raster cannot be packed with the files that go with it: " + std::string(std::strerror(errno)), "",
          ""};
}

/// In the first one's place.
proto::Result<MoreRaster> packed(const fs::path& folder, const std::vector<const MoreRaster*>& files) {
  MoreRaster whole{files.front()->name, files.front()->file + ".zip", "", 0};
  std::string hashes;
  for (const MoreRaster* file : files) {
    whole.bytes += file->bytes;
    hashes += file->name + file->hash;
  }
  whole.hash = digest(hashes);
  if (whole.bytes >= std::numeric_limits<std::uint32_t>::max())
    return proto::Problem{"body-too-large", whole.name + " is too large to be sent with files beside it",
                          "less than 4 GiB; or all of them in one .zip", "file"};
  const fs::path place = folder / whole.file;
  if (auto full = raster::no_room(place.string(), whole.bytes, "a raster with the files that go with it")) return *full;
  {
    std::ofstream out(place, std::ios::binary);
    pipeline::exports::ZipWriter zip(out);
    for (const MoreRaster* file : files) {
      const Mapped mapped(folder / file->file);
      if (!mapped.bytes()) return unwritten();
      zip.add(file->name, *mapped.bytes());
    }
    zip.finish();
    if (!out.flush()) return unwritten();
  }
  if (!raster::sync_path(place.string())) return unwritten();
  std::error_code error;
  for (const MoreRaster* file : files) fs::remove(folder / file->file, error);
  if (!raster::put_in_place(place, folder / files.front()->file)) return unwritten();
  whole.file = files.front()->file;
  return whole;
}

}  // namespace

bool MoreRasters::begin(const std::string& name) {
  if (!end()) return false;
  rasters_.push_back({name, "more" + std::to_string(rasters_.size() + 1), "", 0});
  file_ = std::make_unique<raster::NewFile>(folder_ / rasters_.back().file);
  digest_ = std::make_unique<Digest>();
  return written_ = file_->is_open();
}

bool MoreRasters::add(std::string_view bytes) {
  rasters_.back().bytes += bytes.size();
  digest_->add(bytes);
  return written_ = written_ && file_->write(bytes);
}

bool MoreRasters::end() {
  if (!file_) return written_;
  rasters_.back().hash = digest_->finish();
  written_ = written_ && file_->close();
  file_ = nullptr;
  return written_;
}

proto::Result<std::vector<MoreRaster>> MoreRasters::finish() {
  if (!end())
    return proto::Problem{"storage-full", "a raster cannot be written to disk: " + std::string(std::strerror(errno)), "", ""};
  for (const MoreRaster& raster : rasters_) {
    if (raster.bytes == 0)
      return proto::Problem{"body-empty", "the form's file '" + raster.name + "' is empty", "a raster in each file part", "file"};
  }
  return rasters_;
}

proto::Result<std::vector<MoreRaster>> with_sides_packed(const fs::path& folder, const std::vector<MoreRaster>& files) {
  const std::vector<std::size_t> of = rasters_of(files);
  std::vector<MoreRaster> rasters;
  for (std::size_t k = 0; k < files.size(); ++k) {
    if (of[k] != k) continue;
    std::vector<const MoreRaster*> together{&files[k]};
    for (std::size_t other = 0; other < files.size(); ++other) {
      if (other != k && of[other] == k) together.push_back(&files[other]);
    }
    if (together.size() == 1) {
      rasters.push_back(files[k]);
      continue;
    }
    auto whole = packed(folder, together);
    if (!whole) return whole.problem();
    rasters.push_back(std::move(*whole));
  }
  return rasters;
}

}  // namespace cordillera::server
