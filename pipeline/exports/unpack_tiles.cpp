#include "pipeline/exports/unpack_tiles.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <unordered_set>

#include "pipeline/exports/archive_metadata.h"
#include "pipeline/exports/archive_reader.h"
#include "pipeline/exports/mbtiles.h"
#include "pipeline/exports/whole_file.h"
#include "pipeline/faces/pictures/png_image.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/tileset/html_text.h"
#include "pipeline/tileset/manifest_json.h"
#include "proto/letters.h"
#include "raster/disk/free_space.h"

namespace cordillera::pipeline::exports {
namespace {

namespace fs = std::filesystem;
using faces::Face;

constexpr const char* kPictures = "relief";  // the format of pictures that are nothing else
constexpr const char* kHeights = "terrain-rgb";

std::string first_bytes(const std::string& path, std::size_t count) {
  std::string bytes(count, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

std::string text_of(const Json& metadata, const char* name) {
  const auto found = metadata.find(name);
  return found != metadata.end() && found->is_string() ? found->get<std::string>() : "";
}

[[noreturn]] void refuse(const std::string& why) {
  throw Refused{{"file-unreadable", why, "the raster, the .sqlite file or the folder that it was made of, or a .3tz", "path"}};
}

bool has_layer(const Json& metadata, const std::string& name) {
  const auto layers = metadata.find("vector_layers");
  return layers != metadata.end() && layers->is_array() && std::any_of(layers->begin(), layers->end(), [&](const Json& layer) {
           return layer.is_object() && text_of(layer, "id") == name;
         });
}

/// What the archive says that it holds; null where it does not.
const Face* face_said(const Json& metadata, const std::string& path) {
  if (const Face* face = faces::face_named(text_of(metadata, "face"))) {
    if (!fits_mbtiles(*face))
      refuse(path + " holds " + std::string(face->name) +
             " tiles, and of archives the viewer shows pictures, heights, contours and 3D Tiles");
    return face;
  }
  const std::string format = text_of(metadata, "format"), encoding = text_of(metadata, "encoding");
  if (format == "pbf" || format == "mvt") {
    if (!has_layer(metadata, "contours")) refuse(path + " holds vector tiles, and no terrain");
    return faces::face_named("contours");
  }
  if (encoding == "mapbox") return faces::face_named(kHeights);
  if (encoding == "terrarium") return faces::face_named(encoding);
  for (const Face* face : faces::all_faces()) {  // what this program writes into an MBTiles file
    if (fits_mbtiles(*face) && tiles_of(*face)->about == text_of(metadata, "description")) return face;
  }
  return nullptr;
}

/// Whether a PNG can be no picture: red counts 6,553.6 m, so of ground it is 1 or 2, and 0 where there is nothing or in the deep
/// sea.
bool looks_like_heights(const std::string& bytes) {
  const auto rgb = faces::png_pixels(bytes);
  std::size_t ground = 0;
  for (std::size_t k = 0; k + 2 < rgb.size(); k += 3) {
    if (rgb[k] > 2) return false;
    ground += rgb[k] > 0 ? 1 : 0;
  }
  return ground * 2 * 3 > rgb.size();
}

void write_file(const fs::path& path, std::string_view bytes) {
  std::ofstream out = opened(path);
  append(out, bytes);
  out.close();
}

/// The tiles of one format below a folder.
class Tiles {
 public:
  /// what: is unpacked, in a message.
  Tiles(fs::path folder, const Face& face, std::string what)
      : folder_(std::move(folder)), tiles_(*tiles_of(face)), what_(std::move(what)) {}

  void put(const ArchivedTile& tile) {
    const SquareAddress& at = tile.at;
    if (++count_ > kMostArchived) throw Refused{too_many_archived()};
    const fs::path file = folder_ / faces::path_of(tiles_, place_at(tiles_.grid, at));
    if (known_.insert(file.parent_path().string()).second) fs::create_directories(file.parent_path());
    if (!tile.again || !is_linked(file)) write(file, tile.bytes);
    least_ = std::min(least_, at.zoom);
    const bool finer = at.zoom > most_;
    if (at.zoom > most_) box_ = {at.x, at.y, at.x, at.y};
    most_ = std::max(most_, at.zoom);
    if (at.zoom != most_) return;
    box_ = {std::min(box_.west, at.x), std::min(box_.north, at.y), std::max(box_.east, at.x), std::max(box_.south, at.y)};
    if (finer || !tile.again) last_ = tile.bytes;
  }

  std::uint64_t count() const { return count_; }
  int least_zoom() const { return least_; }
  int most_zoom() const { return most_; }
  const std::string& a_finest() const { return last_; }
  /// Of the finest tiles.
  Extent extent() const {
    const double side = std::ldexp(1.0, most_);
    const auto latitude = [&](double row) { return faces::pixel_latitude_deg(most_, faces::kTilePixels * row); };
    return {box_.west / side * 360 - 180, latitude(box_.south + 1.0), (box_.east + 1.0) / side * 360 - 180, latitude(box_.north)};
  }

 private:
  struct Box {
    std::uint32_t west = 0, north = 0, east = 0, south = 0;
  };
  /// A megabyte of an archive may be the bytes of a million tiles. False where a file has as many names as its disk allows, or
  /// the disk knows no second ones.
  bool is_linked(const fs::path& file) const {
    std::error_code error;
    fs::create_hard_link(written_, file, error);
    return !error;
  }

  void write(const fs::path& file, std::string_view bytes) {
    // Tiles of a small archive may be computed, too.
    if (auto full = raster::no_room(folder_.string(), bytes.size(), what_)) throw Refused{*full};
    write_file(file, bytes);
    written_ = file;
  }

  fs::path folder_, written_;  ///< the last file that was written
  const faces::Resource& tiles_;
  std::string what_;
  std::unordered_set<std::string> known_;  ///< folders that are there
  std::uint64_t count_ = 0;
  int least_ = 99, most_ = -1;
  Box box_;
  std::string last_;
};

/// As the archive states them, where that can be; else of its tiles.
Extent extent_said(const Json& metadata, const Tiles& tiles) {
  std::istringstream text(text_of(metadata, "bounds"));
  Extent said;
  char comma = 0;
  const bool read = bool(text >> said.west >> comma >> said.south >> comma >> said.east >> comma >> said.north);
  const bool is_box = read && said.west < said.east && said.south < said.north && said.west >= -180 && said.east <= 180;
  return is_box && std::max(std::abs(said.south), std::abs(said.north)) <= 90 ? said : tiles.extent();
}

/// Ours have theirs with them.
proto::Manifest manifest_of(const Json& metadata, const Extent& extent, const std::string& path) {
  if (const auto ours = metadata.find("manifest"); ours != metadata.end() && ours->is_object()) {
    if (auto manifest = parse_manifest_json(ours->dump()); manifest.ok() && manifest->bounds_size() >= 4)
      return std::move(*manifest);
  }
  proto::Manifest manifest;
  const std::string name = text_of(metadata, "name");
  manifest.set_name(name.empty() ? fs::path(path).stem().string() : name);
  manifest.set_attribution(plain_text(text_of(metadata, "attribution")));
  for (const double value : {extent.west, extent.south, extent.east, extent.north, 0.0, 0.0}) manifest.add_bounds(value);
  return manifest;
}

Json tilejson_of(const Face& face, const Json& metadata, const Tiles& tiles, const Extent& extent,
                 const proto::Manifest& manifest) {
  Json json = {{"tilejson", "3.0.0"}};
  json["name"] = text_of(metadata, "name");
  if (!manifest.attribution().empty()) json["attribution"] = html_text(manifest.attribution());
  json["tiles"] = {std::string(tiles_of(face)->path)};
  json["vector_layers"] = metadata.value("vector_layers", Json::array());
  json["minzoom"] = tiles.least_zoom();
  json["maxzoom"] = tiles.most_zoom();
  json["bounds"] = {extent.west, extent.south, extent.east, extent.north};
  const View view = view_of(manifest, tiles_of(face)->grid, tiles.least_zoom(), tiles.most_zoom());
  json["center"] = {view.longitude_deg, view.latitude_deg, view.zoom};
  if (face.name == kHeights) json["encoding"] = "mapbox";
  if (face.name == "terrarium") json["encoding"] = "terrarium";
  return json;
}

bool is_set(const std::atomic<bool>* stop) { return stop != nullptr && *stop; }

proto::Problem stopped(const std::string& path) {
  return {"cancelled", "the unpacking of " + path + " was stopped, and nothing of it is kept", "", ""};
}

/// Before anything is written.
void require_room(const ArchiveSize& size, const fs::path& folder, const std::string& what) {
  if (size.tiles > kMostArchived) throw Refused{too_many_archived()};
  const std::string much = what + ", " + std::to_string(size.bytes >> 20) + " MiB";
  if (auto full = raster::no_room(folder.string(), size.bytes, much)) throw Refused{*full};
}

bool is_pmtiles(const std::string& path) { return first_bytes(path, 7) == "PMTiles"; }

std::unique_ptr<ArchiveReader> open_archive(const std::string& path, const std::atomic<bool>* stop) {
  return is_pmtiles(path) ? open_pmtiles(path) : open_mbtiles(path, stop);
}

void unpack(const std::string& path, const fs::path& folder, const std::string& what, const std::atomic<bool>* stop) {
  const auto archive = open_archive(path, stop);
  const Json& metadata = archive->metadata();
  const Face* face = face_said(metadata, path);
  const bool said = face != nullptr;
  if (!said) face = faces::face_named(kPictures);
  if (const auto size = archive->size()) require_room(*size, folder, what);
  Tiles tiles(folder, *face, what);
  archive->each_tile([&](const ArchivedTile& tile) {
    if (is_set(stop)) throw Refused{stopped(path)};
    tiles.put(tile);
  });
  if (tiles.count() == 0) refuse(path + " holds no tiles");
  if (!said && looks_like_heights(tiles.a_finest())) {
    face = faces::face_named(kHeights);
    fs::rename(folder / kPictures, folder / kHeights);
  }
  const Extent extent = extent_said(metadata, tiles);
  const proto::Manifest manifest = manifest_of(metadata, extent, path);
  write_file(folder / std::string(face->entry),
             tilejson_of(*face, metadata, tiles, extent, manifest).dump(1, ' ', false, Json::error_handler_t::replace));
  write_file(folder / "manifest.json", manifest_json(manifest));
}

}  // namespace

bool is_tile_archive(const std::string& path) {
  constexpr std::size_t kApplicationId = 68;  // in the header of an SQLite file
  const std::string begin = first_bytes(path, kApplicationId + 4);
  if (begin.starts_with("PMTiles")) return true;
  return begin.starts_with("SQLite format 3") &&
         (begin.ends_with("MPBX") || proto::lower(fs::path(path).extension().string()) == ".mbtiles");
}

proto::Result<ArchiveWords> describe_archive(const std::string& path) {
  try {
    const auto archive = open_archive(path, nullptr);
    const Json& said = archive->metadata();
    ArchiveWords words{is_pmtiles(path) ? "PMTiles" : "MBTiles",
                       text_of(said, "name"),
                       text_of(said, "attribution"),
                       text_of(said, "bounds"),
                       text_of(said, "format"),
                       text_of(said, "encoding"),
                       text_of(said, "face"),
                       archive->tiles_by_zoom()};
    for (const Face* face : faces::all_faces()) {  // an MBTiles file of this program has no other name for it
      if (words.face.empty() && fits_mbtiles(*face) && tiles_of(*face)->about == text_of(said, "description"))
        words.face = face->name;
    }
    return words;
  } catch (const Refused& refused) { return refused.problem; } catch (const StoreError& e) {
    return unreadable(path, e.what());
  } catch (const fs::filesystem_error& e) { return unreadable(path, e.code().message()); }
}

proto::Result<void> unpack_tiles(const std::string& path, const std::string& folder, const std::atomic<bool>* stop) {
  const std::string what = "what " + fs::path(path).filename().string() + " unpacks to";
  try {
    if (auto full = raster::no_room(folder, fs::file_size(path), what)) return *full;
    unpack(path, folder, what, stop);
    return {};
  } catch (const Refused& refused) { return refused.problem; } catch (const StoreError& e) {
    return is_set(stop) ? stopped(path) : unreadable(path, e.what());
  } catch (const std::ios_base::failure&) {
    return proto::Problem{"storage-full", "there is no room in the temporary folder for " + what,
                          "a TMPDIR on a disk with free space", ""};
  } catch (const fs::filesystem_error& e) {
    return proto::Problem{"archive-unreadable", path + " cannot be unpacked: " + e.code().message(),
                          "a file that can be read, and a TMPDIR that can be written", "path"};
  }
}

}  // namespace cordillera::pipeline::exports
