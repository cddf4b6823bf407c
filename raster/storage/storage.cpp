#include "raster/storage/storage.h"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string_view>

#include "raster/disk/new_file.h"
#include "raster/disk/this_machine.h"
#include "raster/disk/write_all.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/storage/ranged_file.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;

proto::Problem write_problem(const std::string& path, const std::string& why) {
  return {"storage-write", path + " cannot be written" + (why.empty() ? "" : ": " + why),
          "a folder or bucket that can be written, with room", ""};
}
proto::Problem read_problem(const std::string& path, const std::string& why) {
  return {"storage-read", path + " cannot be read" + (why.empty() ? "" : ": " + why), "a file that can be read", ""};
}

struct Closes {
  void operator()(VSILFILE* file) const { VSIFCloseL(file); }
};
using File = std::unique_ptr<VSILFILE, Closes>;

/// An upload has at most 10,000 parts, 50 MB each unless the environment says otherwise: files beyond that need larger ones.
class LargeParts {
 public:
  explicit LargeParts(std::uint64_t bytes) {
    const std::uint64_t part_mb = bytes / 9000 / 1000000 + 1;
    if (part_mb < 50) return;
    for (const char* key : kKeys) CPLSetThreadLocalConfigOption(key, std::to_string(part_mb).c_str());
  }
  ~LargeParts() {
    for (const char* key : kKeys) CPLSetThreadLocalConfigOption(key, nullptr);
  }

 private:
  static constexpr const char* kKeys[] = {"VSIS3_CHUNK_SIZE", "VSIGS_CHUNK_SIZE"};
};

/// Beside the file, and nobody else's: two processes may write the same file at once.
std::string temporary_name(const std::string& path) {
  static std::atomic<unsigned> count{0};
  return path + "." + host_name() + "." + std::to_string(getpid()) + "." + std::to_string(++count) + ".part";
}

proto::Result<void> write_here(const std::string& path, const std::string& bytes) {
  std::error_code error;
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty() && !fs::create_directories(folder, error) && error) return write_problem(path, error.message());
  const std::string part = temporary_name(path);
  const auto failed = [&] {
    const std::string why = std::strerror(errno);
    unlink(part.c_str());
    return write_problem(path, why);
  };
  NewFile file(part, 0666);  // other users' workers read it
  if (!file.is_open() || !file.write(bytes) || !file.close() || rename(part.c_str(), path.c_str()) != 0) return failed();
  sync_path(folder.empty() ? "." : folder.string());  // not every file system that many machines share can
  return {};
}

proto::Result<void> write_remote(const std::string& path, const std::string& bytes) {
  const GdalScope scope(Trust::operator_file);
  VSILFILE* const file = VSIFOpenL(path.c_str(), "wb");
  if (file == nullptr) return write_problem(path, scope.message("", ""));
  const bool put = VSIFWriteL(bytes.data(), 1, bytes.size(), file) == bytes.size();
  // Closing ends the upload: only now is the object there.
  if (VSIFCloseL(file) != 0 || !put || scope.failed()) return write_problem(path, scope.message("", ""));
  return {};
}

}  // namespace

proto::Result<void> upload_file(const std::string& local, const std::string& path) {
  const GdalScope scope(Trust::operator_file);
  const auto bytes = size_of(local);
  const File from(VSIFOpenL(local.c_str(), "rb"));
  if (!from || !bytes) return read_problem(local, scope.message("", ""));
  const LargeParts large_parts(*bytes);
  VSILFILE* const to = VSIFOpenL(path.c_str(), "wb");
  if (to == nullptr) return write_problem(path, scope.message("", ""));
  std::string piece(std::size_t{8} << 20, '\0');
  for (std::uint64_t sent = 0; sent < *bytes;) {
    const std::size_t count = VSIFReadL(piece.data(), 1, std::min<std::uint64_t>(piece.size(), *bytes - sent), from.get());
    // Closing would make an object of what was sent so far. Left open, the upload is never ended, and there is none.
    if (count == 0) return read_problem(local, "it ended early");
    if (VSIFWriteL(piece.data(), 1, count, to) != count) {
      VSIFCloseL(to);  // GDAL ends an upload that failed as such
      return write_problem(path, scope.message("", ""));
    }
    sent += count;
  }
  if (VSIFCloseL(to) != 0 || scope.failed()) return write_problem(path, scope.message("", ""));
  return {};
}

bool is_remote(const std::string& path) { return path.rfind("/vsi", 0) == 0; }

proto::Result<void> write_whole(const std::string& path, const std::string& bytes) {
  return is_remote(path) ? write_remote(path, bytes) : write_here(path, bytes);
}

/// After size_of. A storage that does not answer has left GDAL with something to say, and a name that it does not have has not.
static proto::Result<std::optional<std::string>> not_there(const std::string& path) {
  const std::string why = is_remote(path) ? CPLGetLastErrorMsg() : "";
  if (!why.empty()) return read_problem(path, why);
  return std::optional<std::string>();
}

proto::Result<std::optional<std::string>> read_range(const std::string& path, std::uint64_t offset, std::uint64_t count) {
  const GdalScope scope(Trust::operator_file);
  const auto all = size_of(path);
  if (!all) return not_there(path);
  const File file(VSIFOpenL(path.c_str(), "rb"));
  if (!file || VSIFSeekL(file.get(), offset, SEEK_SET) != 0) return read_problem(path, scope.message("", ""));
  // A file that is damaged may say that there is more than any memory holds.
  std::string bytes(std::min(count, *all - std::min(offset, *all)), '\0');
  bytes.resize(VSIFReadL(bytes.data(), 1, bytes.size(), file.get()));
  if (scope.failed()) return read_problem(path, scope.message("", ""));
  return std::optional(std::move(bytes));
}

proto::Result<std::optional<std::string>> read_whole(const std::string& path) {
  const auto bytes = size_of(path);
  if (!bytes) return not_there(path);
  return read_range(path, 0, *bytes);
}

std::optional<std::string> signed_address(const std::string& path) {
  const GdalScope scope(Trust::operator_file);
  const std::unique_ptr<char, decltype(&VSIFree)> address(VSIGetSignedURL(path.c_str(), nullptr), VSIFree);
  return address ? std::optional<std::string>(address.get()) : std::nullopt;
}

std::optional<std::uint64_t> size_of(const std::string& path) {
  const GdalScope scope(Trust::operator_file);
  if (is_remote(path)) VSICurlPartialClearCache(path.c_str());  // what GDAL remembers was true once
  VSIStatBufL stat{};
  if (VSIStatExL(path.c_str(), &stat,
                 VSI_STAT_EXISTS_FLAG | VSI_STAT_SIZE_FLAG | VSI_STAT_NATURE_FLAG | VSI_STAT_SET_ERROR_FLAG) != 0 ||
      VSI_ISDIR(stat.st_mode)) {
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(stat.st_size);
}

std::string state_of(const std::string& path) {
  if (const RangedFile* const ranged = ranged_file(path)) return ranged->state;
  if (is_vrt_of_ranged_files(path)) return state_of_vrt();
  if (is_remote(path)) {
    const GdalScope scope(Trust::operator_file);
    VSIStatBufL stat{};
    if (VSIStatL(path.c_str(), &stat) != 0) return "";
    return std::to_string(stat.st_size) + " bytes, " + std::to_string(stat.st_mtime);
  }
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
  if (error) return "";
  const auto changed = fs::last_write_time(path, error).time_since_epoch();
  return std::to_string(bytes) + " bytes, " +
         std::to_string(std::chrono::duration_cast<std::chrono::nanoseconds>(changed).count());
}

void ask_anew(const std::string& path) {
  if (is_remote(path))
    VSICurlPartialClearCache(path.c_str());
  else
    std::ifstream(path).peek();
}

std::string told_state(const std::string& state) {
  constexpr std::string_view kBehindSize = " bytes, ";
  const auto comma = state.find(kBehindSize);
  if (comma == state.npos) return state;
  const char* const begin = state.data() + comma + kBehindSize.size();
  std::int64_t number = 0;
  const auto [end, wrong] = std::from_chars(begin, state.data() + state.size(), number);
  if (wrong != std::errc()) return state;
  // As state_of writes them: storage has seconds of Unix time, this machine's disks nanoseconds of the library's own clock.
  constexpr std::int64_t kMostSeconds = 100'000'000'000;
  using namespace std::chrono;
  const auto own = file_clock::time_point(duration_cast<file_clock::duration>(nanoseconds(number)));
  const auto at = number >= 0 && number < kMostSeconds ? sys_time<milliseconds>(seconds(number))
                                                       : floor<milliseconds>(file_clock::to_sys(own));
  const std::time_t whole = system_clock::to_time_t(floor<seconds>(at));
  std::tm utc{};
  gmtime_r(&whole, &utc);
  char text[64];
  const std::size_t length = std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &utc);
  std::snprintf(text + length, sizeof text - length, ".%03d UTC", static_cast<int>((at - floor<seconds>(at)).count()));
  return state.substr(0, comma) + " bytes of " + text + end;
}

proto::Result<std::vector<std::string>> names_in(const std::string& folder) {
  const GdalScope scope(Trust::operator_file);
  if (is_remote(folder)) VSICurlPartialClearCache(folder.c_str());
  if (!is_remote(folder) && access(folder.c_str(), R_OK | X_OK) != 0 && errno != ENOENT)
    return read_problem(folder, std::strerror(errno));
  const CPLStringList read(VSIReadDir(folder.c_str()));
  if (is_remote(folder) && scope.failed()) return read_problem(folder, scope.message("", ""));
  std::vector<std::string> names;
  for (int k = 0; k < read.size(); ++k) {
    const std::string name = read[k];
    if (name != "." && name != "..") names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

bool remove_file(const std::string& path) {
  const GdalScope scope(Trust::operator_file);
  return VSIUnlink(path.c_str()) == 0;
}

}  // namespace cordillera::raster
