#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include "pipeline/tileset/manifest_json.h"
#include "pipeline/store/store.h"
#include "server/cli/commands.h"

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
  std::ifstream file(fs::path(path) / "manifest.json");
  std::ostringstream text;
  text << file.rdbuf();
  const auto manifest = pipeline::parse_manifest_json(text.str());
  if (manifest) return *manifest;
  return proto::Problem{"file-unreadable", path + "/manifest.json is no manifest", accepted, "path"};
}

/// A file here that is neither a dataset nor a folder.
bool may_be_raster(const std::string& path) {
  static const std::string kStore("SQLite format 3\0", 16);
  std::error_code error;
  std::string begin(kStore.size(), ' ');
  std::ifstream file(path, std::ios::binary);
  return fs::is_regular_file(path, error) && file && !(file.read(begin.data(), static_cast<std::streamsize>(begin.size())) && begin == kStore);
}

/// As a dry run without an option.
int tell_of_raster(const std::string& path, Show show) {
  Settings settings;
  settings.dry_run = true;
  BuildLine line;
  line.rasters = {path};
  line.show = show;
  return build_command(settings, line);
}

}  // namespace

int info_command(const std::string& path, Show show) {
  if (may_be_raster(path)) return tell_of_raster(path, show);
  const auto manifest = read_manifest(path);
  if (!manifest) {
    complain(manifest.problem());
    return kFailed;
  }
  std::cout << (show == Show::json ? pipeline::manifest_json(*manifest) : manifest_table(*manifest));
  std::cout << std::flush;
  return kDone;
}

}  // namespace cordillera::server
