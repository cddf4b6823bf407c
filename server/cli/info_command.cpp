#include <filesystem>
#include <iostream>

#include "pipeline/exports/unpack_tiles.h"
#include "pipeline/store/store.h"
#include "pipeline/tileset/manifest_json.h"
#include "proto/letters.h"
#include "proto/utf8.h"
#include "server/cli/commands.h"
#include "server/cli/path_kind.h"
#include "server/http/json.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

proto::Result<proto::Manifest> read_manifest(const std::string& path) {
  std::error_code error;
  const std::string accepted = "a folder that `cordillera build` wrote, a dataset's .sqlite file, or a raster";
  if (!fs::exists(path, error)) return proto::Problem{"file-unreadable", "there is no " + path, accepted, "path"};
  if (fs::is_directory(path, error) && !fs::exists(fs::path(path) / "manifest.json", error)) {
    const auto store = fs::path(path) / "dataset.sqlite";
    if (fs::exists(store, error)) return read_manifest(store.string());
    return proto::Problem{"file-unreadable", path + " holds no manifest.json", accepted, "path"};
  }
  if (!fs::is_directory(path, error)) {
    const auto reader = pipeline::StoreReader::open(path);
    return reader ? proto::Result<proto::Manifest>((*reader)->manifest()) : reader.problem();
  }
  const auto manifest = pipeline::manifest_of_folder(path);
  if (manifest) return *manifest;
  return proto::Problem{"file-unreadable", path + "/manifest.json is no manifest", accepted, "path"};
}

/// As a dry run.
int tell_of_raster(const std::string& path, Show show, Settings settings, BadSource bad) {
  settings.dry_run = true;
  BuildLine line;
  line.rasters = {path};
  line.show = show;
  line.bad = bad;
  return build_command(settings, line);
}

/// A .pmtiles or .mbtiles. What strangers wrote goes to a terminal as one line.
int tell_of_archive(const std::string& path, Show show) {
  const auto words = pipeline::exports::describe_archive(path);
  if (!words) return fail(words.problem());
  std::uint64_t tiles = 0;
  for (const auto& [zoom, count] : words->tiles) tiles += count;
  const auto zoom_text = [](int zoom) { return std::to_string(zoom); };
  if (show == Show::json) {
    Json json = {{"archive", words->kind}, {"tiles", tiles}};
    const std::pair<const char*, const std::string*> texts[] = {
        {"name", &words->name},     {"attribution", &words->attribution}, {"face", &words->face},
        {"format", &words->format}, {"encoding", &words->encoding},       {"bounds", &words->bounds}};
    for (const auto& [name, text] : texts)
      if (!text->empty()) json[name] = *text;
    json["zooms"] = Json::array();
    for (const auto& [zoom, count] : words->tiles) json["zooms"].push_back({{"zoom", zoom}, {"tiles", count}});
    std::cout << dump(json) << std::flush;
    return kDone;
  }
  const auto line = [](const char* name, const std::string& text) {
    if (!text.empty()) std::cout << name << proto::one_line(text) << "\n";
  };
  line("archive   ", words->kind);
  line("name      ", words->name);
  line("holds     ", words->face);
  line("format    ", words->format + (words->encoding.empty() ? "" : ", heights as " + words->encoding));
  if (!words->tiles.empty())
    line("zooms     ", zoom_text(words->tiles.begin()->first) + " to " + zoom_text(words->tiles.rbegin()->first));
  line("bounds    ", words->bounds);
  line("tiles     ", std::to_string(tiles));
  line("source    ", words->attribution);
  std::cout << std::flush;
  return kDone;
}

}  // namespace

int info_command(const std::string& path, Show show, const Settings& settings, BadSource bad) {
  if (const auto closed = refuse_closed(path, "path")) return fail(*closed);
  const PathKind kind = path_kind(path);
  const bool of_maps = kind != PathKind::folder && pipeline::exports::is_tile_archive(path),
             of_3d_tiles = kind == PathKind::raster && proto::lower(fs::path(path).extension().string()) == ".3tz";
  if (of_maps) return tell_of_archive(path, show);
  if (of_3d_tiles) {
    complain({"file-unreadable", path + " is an archive of 3D Tiles",
              "cordillera view " + path + ", which shows it; or what it was made of: a raster, a .sqlite file, a folder",
              "path"});
    return kFailed;
  }
  if (kind == PathKind::raster || holds_rasters(path)) return tell_of_raster(path, show, settings, bad);
  const auto manifest = read_manifest(path);
  if (!manifest) return fail(manifest.problem());
  std::cout << (show == Show::json ? pipeline::manifest_json(*manifest) : manifest_table(*manifest));
  std::cout << std::flush;
  return kDone;
}

}  // namespace cordillera::server
