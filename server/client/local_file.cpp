#include "server/client/local_file.h"

#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include <filesystem>

namespace cordillera::server::client {
namespace {

std::string text_of(const struct stat& state) {
  std::string text;
  for (const auto number :
       {static_cast<long long>(state.st_dev), static_cast<long long>(state.st_ino), static_cast<long long>(state.st_size),
        static_cast<long long>(state.st_mtim.tv_sec), static_cast<long long>(state.st_mtim.tv_nsec),
        static_cast<long long>(state.st_ctim.tv_sec), static_cast<long long>(state.st_ctim.tv_nsec)}) {
    text += std::to_string(number) + " ";
  }
  return text;
}

}  // namespace

proto::Result<std::unique_ptr<LocalFile>> LocalFile::open(const std::string& path) {
  const auto unreadable = [&path](const std::string& why) {
    return proto::Problem{"file-unreadable", path + ": " + why, "a raster that is one file, such as a GeoTIFF", "raster"};
  };
  raster::Descriptor opened(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));  // a pipe must not keep us waiting
  if (!opened.is_open()) return unreadable(strerror(errno));
  std::error_code error;
  auto file = std::unique_ptr<LocalFile>(new LocalFile(std::filesystem::canonical(path, error).string(), std::move(opened)));
  if (fstat(file->file_.number(), &file->state_) != 0) return unreadable(strerror(errno));
  if (!S_ISREG(file->state_.st_mode)) return unreadable("it is no file");
  if (file->state_.st_size == 0) return unreadable("it is empty");
  return file;
}

bool LocalFile::changed() const {
  struct stat now = {};
  return fstat(file_.number(), &now) != 0 || text_of(now) != text_of(state_);
}

std::string LocalFile::identity() const { return text_of(state_); }

std::optional<std::string_view> LocalFile::read(std::uint64_t from, std::size_t most) {
  bytes_.resize(most);
  const ssize_t count = pread(file_.number(), bytes_.data(), most, static_cast<off_t>(from));
  if (count <= 0) {
    problem_ = proto::Problem{"file-unreadable", path_ + ": " + (count < 0 ? strerror(errno) : "it is shorter than it was"),
                              "a raster that nobody writes to", "raster"};
    return std::nullopt;
  }
  const auto end = from + static_cast<std::uint64_t>(count);
  if (end == size() && changed()) {
    problem_ = proto::Problem{"source-changed", path_ + " was written to while it was sent",
                              "the same line again, when nobody writes to it", "raster"};
    return std::nullopt;
  }
  return std::string_view(bytes_.data(), static_cast<std::size_t>(count));
}

}  // namespace cordillera::server::client
