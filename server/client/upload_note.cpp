#include "server/client/upload_note.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "server/http/digest.h"
#include "server/http/json.h"
#include "server/uploads/part_files.h"

namespace cordillera::server::client {
namespace {

namespace fs = std::filesystem;

fs::path notes_folder() {
  if (const char* state = std::getenv("XDG_STATE_HOME"); state != nullptr && *state == '/')
    return fs::path(state) / "cordillera" / "uploads";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home == '/')
    return fs::path(home) / ".local" / "state" / "cordillera" / "uploads";
  return {};
}

/// A service forgets an upload after so many days; notes of them serve nobody.
void remove_old(const fs::path& folder) {
  std::error_code error;
  const auto oldest = fs::file_time_type::clock::now() - std::chrono::hours(24 * (uploads::kKeptDays + 1));
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (fs::last_write_time(entry.path(), error) < oldest) fs::remove(entry.path(), error);
  }
}

}  // namespace

proto::Result<std::unique_ptr<UploadNote>> UploadNote::open(const std::string& purpose, const std::string& identity) {
  const fs::path folder = notes_folder();
  std::error_code error;
  if (!folder.empty()) fs::create_directories(folder, error);
  const fs::path path = folder / (digest(purpose).substr(0, 32) + ".json");
  if (!folder.empty()) remove_old(folder);
  raster::Descriptor file;
  while (!folder.empty()) {
    // Nobody else reads it: without tokens an upload belongs to whoever knows its name.
    file = raster::Descriptor(::open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600));
    if (!file.is_open()) break;
    if (flock(file.number(), LOCK_EX | LOCK_NB) != 0)
      return proto::Problem{"upload-running", "another process is sending this raster to this service", "waiting for its end",
                            "raster"};
    struct stat state = {};
    if (fstat(file.number(), &state) != 0 || state.st_nlink > 0) break;
    // Its owner was done and removed it between the two calls.
  }
  auto note = std::unique_ptr<UploadNote>(new UploadNote(path.string(), std::move(file), identity));
  if (note->file_.is_open()) note->read();
  return note;
}

UploadNote::~UploadNote() {
  if (upload_.empty()) remove();
}

void UploadNote::read() {
  char bytes[1024];
  const ssize_t count = pread(file_.number(), bytes, sizeof bytes, 0);
  const Json json = Json::parse(std::string(bytes, count > 0 ? static_cast<std::size_t>(count) : 0), nullptr, false);
  if (!json.is_object()) return;
  (json.value("identity", "") == identity_ ? upload_ : outdated_) = json.value("upload", "");
}

void UploadNote::keep(const std::string& upload) {
  upload_ = upload;
  outdated_.clear();
  if (!file_.is_open()) return;
  // In place, for the lock is on this very file. A line that is cut off is none: a new upload begins.
  const std::string line = Json{{"upload", upload}, {"identity", identity_}}.dump() + "\n";
  if (ftruncate(file_.number(), 0) != 0 ||
      pwrite(file_.number(), line.data(), line.size(), 0) != static_cast<ssize_t>(line.size()))
    return;
  fsync(file_.number());
}

void UploadNote::remove() {
  upload_.clear();
  if (!file_.is_open()) return;
  unlink(path_.c_str());
  file_.close();
}

}  // namespace cordillera::server::client
