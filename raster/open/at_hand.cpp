#include "raster/open/at_hand.h"

#include <gdal_priv.h>

#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "proto/utf8.h"
#include "raster/archive/archive.h"
#include "raster/disk/free_space.h"
#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/open/point_grid.h"
#include "raster/open/point_lines.h"
#include "raster/open/remote.h"
#include "raster/storage/storage.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

/// Copies of files, by path and state. Who wants one that is being made waits for it. What nobody has any longer is forgotten,
/// but for the last ones: a mosaic looks at all of its files before it samples them.
class Copies {
 public:
  proto::Result<AtHand> get(const std::string& key, const std::function<proto::Result<AtHand>()>& make) {
    std::unique_lock lock(mutex_);
    if (auto there = look_up(key)) return *std::move(there);
    if (const auto begun = making_.find(key); begun != making_.end()) {
      const std::shared_future<proto::Result<AtHand>> other = begun->second;
      lock.unlock();
      return other.get();
    }
    std::promise<proto::Result<AtHand>> promise;
    making_.emplace(key, promise.get_future().share());
    lock.unlock();
    try {
      auto made = make();
      lock.lock();
      if (made.ok()) keep(key, *made);
      making_.erase(key);
      promise.set_value(made);
      return made;
    } catch (...) {
      if (!lock.owns_lock()) lock.lock();
      making_.erase(key);
      promise.set_exception(std::current_exception());
      throw;
    }
  }
  /// Nothing where there is none yet.
  std::optional<AtHand> find(const std::string& key) {
    const std::scoped_lock lock(mutex_);
    return look_up(key);
  }

 private:
  std::optional<AtHand> look_up(const std::string& key) {
    copies_.remove_if([](const Copy& copy) { return copy.folder.expired(); });
    for (const Copy& copy : copies_) {
      const auto folder = copy.folder.lock();
      if (copy.key != key || !folder) continue;
      AtHand found = copy.found;
      found.folder = folder;
      return found;
    }
    return std::nullopt;
  }

  void keep(const std::string& key, const AtHand& made) {
    copies_.push_front({key, made, made.folder});
    copies_.front().found.folder.reset();
    std::error_code error;
    const auto bytes = fs::file_size(made.path, error);
    last_.push_front({made.folder, error ? 0 : bytes});
    last_bytes_ += last_.front().bytes;
    for (; last_.size() > kKept || (last_.size() > 1 && last_bytes_ > kKeptBytes); last_.pop_back())
      last_bytes_ -= last_.back().bytes;
  }

  static constexpr std::size_t kKept = 64;
  static constexpr std::uintmax_t kKeptBytes = std::uintmax_t{1} << 30;
  struct Last {
    std::shared_ptr<const PrivateFolder> folder;
    std::uintmax_t bytes = 0;
  };
  struct Copy {
    std::string key;
    AtHand found;  ///< without its folder, which it must not hold
    std::weak_ptr<const PrivateFolder> folder;
  };
  std::mutex mutex_;
  std::list<Copy> copies_;
  std::list<Last> last_;  ///< the newest first
  std::uintmax_t last_bytes_ = 0;
  std::map<std::string, std::shared_future<proto::Result<AtHand>>> making_;
};

Copies& unpacked_copies() {
  static Copies copies;
  return copies;
}

Copies& grid_copies() {
  static Copies copies;
  return copies;
}

Copies& row_copies() {
  static Copies copies;
  return copies;
}

Problem no_room(const std::string& name) {
  return {"storage-full", "no temporary folder can be made to open " + name + " in", "a disk with free space", ""};
}

/// What a text is to begin with for drivers, in place of its first bytes.
struct TextHead {
  std::size_t bytes = 0;
  std::string words;
};

/// A byte order mark, which drivers take for a part of the first word, and names of columns that GDAL does not know. Nothing: the
/// file may stay as it is.
proto::Result<std::optional<TextHead>> head_to_change(const std::string& path, const std::string& name) {
  std::ifstream file(path, std::ios::binary);
  std::string head(4096, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  const std::size_t mark = head.starts_with(proto::kUtf8Mark) ? proto::kUtf8Mark.size() : 0;
  const auto names = names_for_gdal(std::string_view(head).substr(mark), name);
  if (!names) return names.problem();
  if (*names) return std::optional(TextHead{std::min(head.find_first_of("\r\n"), head.size()), **names});
  return mark > 0 ? std::optional(TextHead{mark, ""}) : std::nullopt;
}

std::optional<Problem> copy_with_head(const TextHead& head, const std::string& path, const std::string& to,
                                      const std::string& name) {
  std::error_code error;
  if (auto full = raster::no_room(to, fs::file_size(path, error), "a copy of " + name)) return full;
  std::ifstream from(path, std::ios::binary);
  from.seekg(static_cast<std::streamoff>(head.bytes));
  std::ofstream copy(to, std::ios::binary);
  copy << head.words << from.rdbuf();
  return copy.flush() ? std::nullopt : std::optional(no_room(name));
}

/// Text names no CRS; Esri's programs write it beside it. Beside a posted file that came alone lies somebody else's.
void copy_crs_beside(const AtHand& text, const std::string& to, Trust trust) {
  for (const char* extension : {".prj", ".PRJ"}) {
    if (trust == Trust::posted_file && !text.folder) break;
    if (std::ifstream prj(fs::path(text.path).replace_extension(extension)); prj)
      std::ofstream(fs::path(to).replace_extension(".prj")) << prj.rdbuf();
  }
}

proto::Result<AtHand> make_readable(const TextHead& head, const std::string& path, const std::string& name, Trust trust) {
  const auto folder = std::make_shared<const PrivateFolder>();
  if (!folder->made()) return no_room(name);
  AtHand readable{folder->place(name), name, name, folder};
  if (auto full = copy_with_head(head, path, readable.path, name)) return *full;
  copy_crs_beside({path, name, name, nullptr}, readable.path, trust);
  return readable;
}

/// Of an archive elsewhere all is fetched: to read a place in it, all before it would be fetched and unpacked again.
proto::Result<Member> unpacked(const std::string& path, const std::string& name, const PrivateFolder& folder) {
  if (!is_remote(path)) return unpack(path, name, folder);
  const PrivateFolder own;  // which the archive leaves with
  if (!own.made()) return no_room(name);
  const auto here = fetched(path, name, own);
  if (!here) return here.problem();
  if (is_archive(*here)) return unpack(*here, name, folder);
  return Problem{"archive-unreadable", name + " is neither a .zip nor a .gz, whatever its name",
                 "a complete, undamaged archive, or the raster under a name of its own", ""};
}

proto::Result<AtHand> make_unpacked(const std::string& path, const std::string& name) {
  const auto folder = std::make_shared<const PrivateFolder>();
  if (!folder->made()) return no_room(name);
  const auto member = unpacked(path, name, *folder);
  if (!member) return member.problem();
  if (is_archive(member->path))
    return Problem{"raster-format-unsupported", name + " holds an archive, " + proto::shown_text(member->name),
                   "a .zip or .gz with one raster in it", ""};
  const auto head = head_to_change(member->path, member->name);
  if (!head) return head.problem();
  if (*head) {
    const std::string as_it_was = member->path + ".as-it-was";
    std::error_code error;
    fs::rename(member->path, as_it_was, error);
    if (auto full = copy_with_head(**head, as_it_was, member->path, name)) return *full;
    fs::remove(as_it_was, error);
  }
  return AtHand{member->path, name == member->name ? name : name + "/" + proto::shown_text(member->name), member->name, folder};
}

proto::Result<AtHand> make_grid(const AtHand& points, Trust trust) {
  const GdalScope scope(trust);
  const auto folder = std::make_shared<const PrivateFolder>();
  if (!folder->made()) return no_room(points.name);
  AtHand grid{folder->place("grid.tif"), points.name, points.file, folder};
  copy_crs_beside(points, grid.path, trust);
  if (auto problem = write_point_grid(points.path, points.name, grid.path, scope)) return *problem;
  return grid;
}

}  // namespace

std::string copy_key(const std::string& path, const std::string& name) { return path + "\n" + name + "\n" + state_of(path); }

proto::Result<AtHand> at_hand(const std::string& path, const std::string& name, Trust trust) {
  const std::string file = fs::path(name.empty() ? path : name).filename().string();
  const bool packed = is_remote(path) ? is_remote_archive(path) : is_archive(path);
  if (!packed) {
    const auto head = is_remote(path) ? proto::Result<std::optional<TextHead>>(std::nullopt) : head_to_change(path, file);
    if (!head) return head.problem();
    if (!*head) return AtHand{path, file, file, nullptr};
    return unpacked_copies().get(copy_key(path, file) + (trust == Trust::posted_file ? "\nalone" : ""),
                                 [&] { return make_readable(**head, path, file, trust); });
  }
  return unpacked_copies().get(copy_key(path, file), [&] { return make_unpacked(path, file); });
}

std::optional<AtHand> known_grid(const AtHand& points, const std::string& key) {
  return grid_copies().find(copy_key(key, points.name));
}

proto::Result<AtHand> gridded(const AtHand& points, const std::string& key, Trust trust) {
  return grid_copies().get(copy_key(key, points.name), [&] { return make_grid(points, trust); });
}

proto::Result<AtHand> shared_copy(const std::string& key, const std::function<proto::Result<AtHand>()>& make) {
  return row_copies().get(key, make);
}

}  // namespace cordillera::raster
