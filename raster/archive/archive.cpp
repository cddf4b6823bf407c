#include "raster/archive/archive.h"

#include <cpl_vsi.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "proto/utf8.h"
#include "raster/archive/zip_sums.h"
#include "raster/disk/free_space.h"
#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr std::size_t kMostEntries = 10000;
constexpr std::size_t kPiece = std::size_t{1} << 20;

constexpr const char* kOneRaster = "a .zip or .gz with one raster, and in a .zip the files of the same name that it needs";
constexpr const char* kSeveral =
    "a .zip with one raster; of several, the rasters (posted as one form: curl -F file=@a.tif -F file=@b.tif), or the folder "
    "that it unpacks to";

struct ArchiveEntry {
  std::string path;  ///< in the zip
  std::uint64_t bytes = 0;
  std::optional<std::uint32_t> sum{};  ///< that nobody has compared with its bytes
  std::string name() const { return fs::path(path).filename().string(); }
};

/// What may still be unpacked of an archive.
class Bound {
 public:
  Bound(const std::string& path, const std::string& name, const UnpackLimit& limit) : name_(name), limit_(limit) {
    std::error_code error;
    const auto bytes = fs::file_size(path, error);
    left_ = most_ = std::max(limit.at_least, error ? 0 : limit.times * bytes);
  }
  bool holds(std::uint64_t bytes) const { return bytes <= left_; }
  void take(std::uint64_t bytes) { left_ -= bytes; }
  Problem passed() const {
    return {"archive-too-large", name_ + " would unpack to more than " + std::to_string(most_ >> 20) + " MiB",
            "at most " + std::to_string(limit_.times) + " times the archive's size, or " + std::to_string(limit_.at_least >> 20) +
                " MiB if that is more; what is larger as a compressed GeoTIFF",
            ""};
  }

 private:
  const std::string name_;
  const UnpackLimit limit_;
  std::uint64_t most_ = 0, left_ = 0;
};

Problem damaged(const std::string& name, const std::string& why) {
  const bool about_sources = why.find("cpl_") != why.npos;  // of GDAL's sources, and what it calls in them
  return {"archive-unreadable", name + " cannot be unpacked" + (why.empty() || about_sources ? "" : ": " + why),
          "a complete, undamaged archive without a password, deflated as usual", ""};
}

/// A piece, or a file of a zip, beside this path.
std::optional<Problem> no_room_for(const std::string& name, const std::string& path, std::uint64_t bytes) {
  return no_room(path, bytes, "what " + name + " unpacks to");
}

/// Of the disk that holds the path.
Problem no_space(const std::string& name, const std::string& path) {
  if (auto full = no_room_for(name, path, kPiece)) return *full;
  return {"storage-full", "there is no room in the temporary folder to unpack " + name, "a disk with free space", ""};
}

/// Bytes into the buffer, 0 at the end, -1 where the archive is damaged.
using Reads = std::function<std::int64_t(char* buffer, std::size_t count)>;

enum class Copied { whole, damaged, too_much, no_room };

Copied copy(const Reads& read, const std::string& to, Bound& bound) {
  std::ofstream out(to, std::ios::binary);
  std::string piece(kPiece, '\0');
  for (std::int64_t count = 0; (count = read(piece.data(), piece.size())) != 0;) {
    if (count < 0) return Copied::damaged;
    if (!bound.holds(static_cast<std::uint64_t>(count))) return Copied::too_much;
    bound.take(static_cast<std::uint64_t>(count));
    if (no_room(to, static_cast<std::uint64_t>(count), "")) return Copied::no_room;
    if (!out.write(piece.data(), count)) return Copied::no_room;
  }
  return out.flush() ? Copied::whole : Copied::no_room;
}

// --- gz ---

std::string without_gz(const std::string& name) { return extension_of(name) == ".gz" ? name.substr(0, name.size() - 3) : name; }

bool is_tar(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  char head[262] = "";
  return file.read(head, sizeof head) && std::string_view(head + 257, 5) == "ustar";
}

proto::Result<Member> gunzip(const std::string& path, const std::string& name, const PrivateFolder& folder, Bound& bound) {
  Member member{folder.place(without_gz(name)), without_gz(name)};
  const gzFile file = gzopen(path.c_str(), "rb");
  if (file == nullptr) return damaged(name, "");
  const auto read = [&](char* buffer, std::size_t count) {
    return std::int64_t{gzread(file, buffer, static_cast<unsigned>(count))};
  };
  const Copied copied = copy(read, member.path, bound);
  int code = Z_OK;
  const std::string why = gzerror(file, &code);
  const bool whole = gzclose_r(file) == Z_OK;  // Z_BUF_ERROR: it ends before its end
  if (copied == Copied::too_much) return bound.passed();
  if (copied == Copied::no_room) return no_space(name, member.path);
  if (copied != Copied::whole || !whole) return damaged(name, code == Z_OK ? "it ends early" : fs::path(why).filename().string());
  if (is_tar(member.path)) return Problem{"archive-rasters", name + " is a tar archive", kOneRaster, ""};
  return member;
}

// --- zip ---

/// What systems put beside what was packed.
bool is_dross(const ArchiveEntry& entry) { return entry.name().starts_with(".") || entry.path.starts_with("__MACOSX/"); }

std::string in_gdal(const std::string& zip) { return "/vsizip/{" + zip + "}"; }

proto::Result<std::vector<ArchiveEntry>> entries_of(const std::string& zip, const std::string& name) {
  const std::map<std::string, std::uint32_t> sums = sums_of_stored(zip);
  const std::unique_ptr<VSIDIR, void (*)(VSIDIR*)> folder(VSIOpenDir(in_gdal(zip).c_str(), -1, nullptr), VSICloseDir);
  if (!folder) return damaged(name, "it has no readable list of its files");
  std::vector<ArchiveEntry> entries;
  while (const VSIDIREntry* entry = VSIGetNextDirEntry(folder.get())) {
    if (VSI_ISDIR(entry->nMode)) continue;
    entries.push_back({entry->pszName, static_cast<std::uint64_t>(entry->nSize)});
    if (const auto sum = sums.find(entry->pszName); sum != sums.end()) entries.back().sum = sum->second;
    if (is_dross(entries.back())) entries.pop_back();
  }
  return entries;
}

Problem not_one(const std::string& name, const std::vector<ArchiveEntry>& found, const std::string& what,
                const char* accepted = kOneRaster) {
  constexpr std::size_t kNamed = 6;
  std::string names;
  for (std::size_t k = 0; k < std::min(found.size(), kNamed); ++k)
    names += (k == 0 ? "" : ", ") + proto::shown_text(found[k].path, 60);
  if (found.size() > kNamed) names += ", …";
  return {"archive-rasters", name + " holds " + what + (names.empty() ? "" : ": " + names), accepted, ""};
}

/// By its extension; where no file has a raster's, the only file that is no side file.
proto::Result<ArchiveEntry> raster_of(const std::vector<ArchiveEntry>& entries, const std::string& name) {
  std::vector<ArchiveEntry> rasters, others;
  for (const ArchiveEntry& entry : entries) {
    const std::string extension = extension_of(entry.name());
    if (is_raster_extension(extension)) rasters.push_back(entry);
    if (!is_side_extension(extension)) others.push_back(entry);
  }
  if (rasters.size() == 1) return rasters.front();
  if (rasters.size() > 1) return not_one(name, rasters, std::to_string(rasters.size()) + " rasters", kSeveral);
  if (others.size() == 1) return others.front();
  return not_one(name, entries, "no raster");
}

bool goes_with(const ArchiveEntry& raster, const ArchiveEntry& other) {
  return fs::path(other.path).parent_path() == fs::path(raster.path).parent_path() && is_side_of(raster.name(), other.name());
}

/// GDAL would open it with any driver, such as one that reads other files. Without it, masked pixels would become heights.
Problem mask_beside(const std::string& name, const ArchiveEntry& raster, const ArchiveEntry& mask) {
  return {"archive-rasters", name + " holds a mask beside its raster: " + proto::shown_text(mask.name(), 60),
          "a raster with its mask inside; this makes one of both: " +
              copying_line("gdal_translate --config GDAL_TIFF_INTERNAL_MASK YES", raster.name()),
          ""};
}

proto::Result<void> extract(const std::string& zip, const ArchiveEntry& entry, const std::string& name, const std::string& to,
                            Bound& bound) {
  const GdalScope scope(Trust::posted_file);
  if (!bound.holds(entry.bytes)) return bound.passed();
  if (auto full = no_room_for(name, to, entry.bytes)) return *full;
  VSILFILE* const file = VSIFOpenL((in_gdal(zip) + "/" + entry.path).c_str(), "rb");
  if (file == nullptr) return damaged(name, scope.message(zip, name));
  std::uint64_t come = 0;
  uLong sum = crc32(0, nullptr, 0);
  const Copied copied = copy(
      [&](char* buffer, std::size_t count) {
        const auto read = static_cast<std::int64_t>(VSIFReadL(buffer, 1, count, file));
        come += static_cast<std::uint64_t>(read);
        sum = crc32(sum, reinterpret_cast<const Bytef*>(buffer), static_cast<uInt>(read));
        return scope.failed() ? -1 : read;  // a wrong checksum too
      },
      to, bound);
  VSIFCloseL(file);
  if (copied == Copied::too_much) return bound.passed();
  if (copied == Copied::no_room) return no_space(name, to);
  if (copied == Copied::damaged || come != entry.bytes)
    return damaged(name, scope.failed() ? scope.message(zip, name) : proto::shown_text(entry.name()) + " ends early");
  if (entry.sum && *entry.sum != sum)
    return damaged(name, proto::shown_text(entry.name()) + " has another checksum than it says");
  return {};
}

proto::Result<Member> unzip(const std::string& path, const std::string& name, const PrivateFolder& folder, Bound& bound) {
  const GdalScope scope(Trust::posted_file);
  // Under a name of ours, which holds nothing that GDAL would take for more than a name.
  const std::string link = folder.link(path, "archive.zip");
  if (link.empty()) return no_space(name, folder.place(name));
  if (auto listed = check_list(link, name, kMostEntries); !listed.ok()) return listed.problem();
  const auto entries = entries_of(link, name);
  if (!entries) return entries.problem();
  const auto raster = raster_of(*entries, name);
  if (!raster) return raster.problem();
  for (const ArchiveEntry& entry : *entries) {
    if (entry.path != raster->path && !goes_with(*raster, entry)) continue;
    if (is_mask(entry.name())) return mask_beside(name, *raster, entry);
    const std::string to = is_pam(entry.name()) ? pam_of_unpacked(folder.place(raster->name())) : folder.place(entry.name());
    if (auto done = extract(link, entry, name, to, bound); !done.ok()) return done.problem();
  }
  return Member{folder.place(raster->name()), raster->name()};
}

/// Of the file of this name with the fewest folders above it: those, with a slash at their end. Nullopt: there is none.
std::optional<std::string> folder_of(const std::vector<ArchiveEntry>& entries, const std::string& marker) {
  std::optional<std::string> least;
  for (const ArchiveEntry& entry : entries) {
    if (entry.name() != marker) continue;
    const std::string above = entry.path.substr(0, entry.path.size() - marker.size());
    if (!least || std::count(above.begin(), above.end(), '/') < std::count(least->begin(), least->end(), '/')) least = above;
  }
  return least;
}

/// Below the folder that it is to lie in, and of plain names.
bool stays_below(const fs::path& path) {
  return path.is_relative() &&
         std::all_of(path.begin(), path.end(), [](const fs::path& part) { return part != ".." && part != "." && !part.empty(); });
}

bool begins_with(const std::string& path, std::string_view with) {
  std::ifstream file(path, std::ios::binary);
  std::string head(with.size(), '\0');
  return file.read(head.data(), static_cast<std::streamsize>(head.size())) && head == with;
}

bool is_zip(const std::string& path) { return begins_with(path, "PK\x03\x04"); }

}  // namespace

bool is_archive(const std::string& path) { return is_zip(path) || begins_with(path, "\x1f\x8b"); }

proto::Result<Member> unpack(const std::string& path, const std::string& name, const PrivateFolder& folder,
                             const UnpackLimit& limit) {
  Bound bound(path, name, limit);
  return is_zip(path) ? unzip(path, name, folder, bound) : gunzip(path, name, folder, bound);
}

proto::Result<bool> unpack_folder(const std::string& path, const std::string& name, const std::string& marker,
                                  const PrivateFolder& folder, const std::atomic<bool>* stop) {
  if (!is_zip(path)) return false;
  const GdalScope scope(Trust::posted_file);
  const PrivateFolder aside;  // no entry may be written through the link
  const std::string link = aside.link(path, "archive.zip");
  if (link.empty()) return no_space(name, folder.place(name));
  const auto entries = entries_of(link, name);
  if (!entries) return entries.problem();
  const auto below = folder_of(*entries, marker);
  if (!below) return false;
  Bound bound(path, name, {.times = 0, .at_least = std::numeric_limits<std::uint64_t>::max()});
  for (const ArchiveEntry& entry : *entries) {
    if (!entry.path.starts_with(*below)) continue;
    if (stop != nullptr && *stop)
      return Problem{"cancelled", "the unpacking of " + name + " was stopped, and nothing of it is kept", "", ""};
    const fs::path own = entry.path.substr(below->size());
    if (!stays_below(own)) return damaged(name, proto::shown_text(entry.path) + " is no path below it");
    const fs::path to = fs::path(folder.path()) / own;
    std::error_code error;
    fs::create_directories(to.parent_path(), error);
    if (auto done = extract(link, entry, name, to.string(), bound); !done.ok()) return done.problem();
  }
  return true;
}

}  // namespace cordillera::raster
