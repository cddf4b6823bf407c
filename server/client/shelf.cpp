#include "server/client/shelf.h"

#include <fcntl.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "raster/disk/write_all.h"
#include "server/http/json.h"

namespace cordillera::server::client {
namespace {

namespace fs = std::filesystem;

proto::Problem cannot_write(const fs::path& path, const std::string& why) {
  return {"output-failed", "cannot write " + path.string() + ": " + why, "a folder that can be written, with room", "--output"};
}

/// Changes with every write. Empty: no such file.
std::string state_of(const fs::path& path) {
  struct stat state = {};
  if (stat(path.c_str(), &state) != 0) return "";
  return std::to_string(state.st_size) + " " + std::to_string(state.st_mtim.tv_sec) + " " + std::to_string(state.st_mtim.tv_nsec);
}

}  // namespace

proto::Result<std::unique_ptr<Shelf>> Shelf::open(const fs::path& folder) {
  const fs::path own = folder / ".cordillera-fetch", path = own / "tags";
  std::error_code error;
  fs::create_directories(own, error);
  if (error) return cannot_write(own, error.message());
  raster::Descriptor notes(::open(path.c_str(), O_CREAT | O_RDWR | O_APPEND | O_CLOEXEC, 0644));
  if (!notes.is_open()) return cannot_write(path, strerror(errno));
  auto shelf = std::unique_ptr<Shelf>(new Shelf(folder, std::move(notes)));
  if (flock(shelf->notes_.number(), LOCK_EX | LOCK_NB) ==
      0) {  // nobody else fetches: what lies there was left by a process that was killed
    for (const auto& entry : fs::directory_iterator(own, error)) {
      if (entry.path().extension() == ".part") fs::remove(entry.path(), error);
    }
  }
  flock(shelf->notes_.number(), LOCK_SH);
  shelf->read();
  return shelf;
}

Shelf::~Shelf() {
  // Lines that no longer count go when they are the greater part, and nobody else adds any.
  if (lines_ > 2 * known_.size() + 100 && flock(notes_.number(), LOCK_EX | LOCK_NB) == 0 && ftruncate(notes_.number(), 0) == 0) {
    for (const auto& [name, known] : known_) note(name, known);
  }
}

void Shelf::read() {
  std::ifstream file(own() / "tags");
  for (std::string line; std::getline(file, line); ++lines_) {
    const Json json = Json::parse(line, nullptr, false);  // a line may have been cut off
    if (json.is_object())
      known_[json.value("file", "")] = {json.value("from", ""), json.value("tag", ""), json.value("state", "")};
  }
}

void Shelf::note(const std::string& name, const Known& known) {
  const std::string line = Json{{"file", name}, {"from", known.from}, {"tag", known.tag}, {"state", known.state}}.dump(
                               -1, ' ', false, Json::error_handler_t::replace) +
                           "\n";
  if (raster::write_all(notes_.number(), line)) ++lines_;  // without it the file comes again another time
}

std::string Shelf::tag(const std::string& name, const std::string& from) const {
  const std::lock_guard lock(mutex_);
  const auto found = known_.find(name);
  const bool same = found != known_.end() && found->second.from == from && !found->second.state.empty() &&
                    found->second.state == state_of(folder_ / name);
  return same ? found->second.tag : "";
}

Shelf::Part::Part(Shelf& shelf) : shelf_(shelf) {
  {
    const std::lock_guard lock(shelf.mutex_);
    path_ = shelf.own() / (std::to_string(getpid()) + "-" + std::to_string(shelf.parts_++) + ".part");
  }
  file_ = raster::Descriptor(::open(path_.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0644));
}

Shelf::Part::~Part() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove(path_, ignored);
}

bool Shelf::Part::write(std::string_view bytes) { return file_.is_open() && raster::write_all(file_.number(), bytes); }

proto::Result<void> Shelf::Part::put(const std::string& name, const std::string& from, const std::string& tag) {
  const fs::path place = shelf_.folder_ / name;
  if (!file_.is_open()) return cannot_write(path_, "it could not be made");
  const bool closed = file_.close();
  std::error_code error;
  if (!closed) return cannot_write(path_, strerror(errno));
  if (place.has_parent_path()) fs::create_directories(place.parent_path(), error);
  fs::rename(path_, place, error);
  if (error) return cannot_write(place, error.message());
  path_.clear();
  const std::lock_guard lock(shelf_.mutex_);
  const Known known = {from, tag, state_of(place)};
  shelf_.known_[name] = known;
  shelf_.note(name, known);
  return {};
}

}  // namespace cordillera::server::client
