#include "raster/disk/write_all.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

#include "raster/disk/descriptor.h"

namespace cordillera::raster {
namespace {

/// some(done): moves some of the bytes that are left, as read and write do.
template <class Some>
bool all(std::size_t count, const Some& some) {
  for (std::size_t done = 0; done < count;) {
    const ssize_t now = some(done);
    if (now < 0 && errno == EINTR) continue;
    if (now <= 0) return false;
    done += static_cast<std::size_t>(now);
  }
  return true;
}

}  // namespace

bool write_all(int descriptor, std::string_view bytes) {
  return all(bytes.size(), [&](std::size_t done) { return ::write(descriptor, bytes.data() + done, bytes.size() - done); });
}

bool write_all_at(int descriptor, std::string_view bytes, std::uint64_t first) {
  return all(bytes.size(), [&](std::size_t done) {
    return ::pwrite(descriptor, bytes.data() + done, bytes.size() - done, static_cast<off_t>(first + done));
  });
}

bool read_all(int descriptor, std::span<char> bytes) {
  return all(bytes.size(), [&](std::size_t done) { return ::read(descriptor, bytes.data() + done, bytes.size() - done); });
}

bool read_all_at(int descriptor, std::span<char> bytes, std::uint64_t first) {
  return all(bytes.size(), [&](std::size_t done) {
    return ::pread(descriptor, bytes.data() + done, bytes.size() - done, static_cast<off_t>(first + done));
  });
}

bool sync_path(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  return file.is_open() && ::fsync(file.number()) == 0;
}

bool put_in_place(const std::filesystem::path& from, const std::filesystem::path& to) {
  const std::filesystem::path folder = to.parent_path();
  return ::rename(from.c_str(), to.c_str()) == 0 && sync_path(folder.empty() ? "." : folder.string());
}

}  // namespace cordillera::raster
