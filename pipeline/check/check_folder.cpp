#include <algorithm>
#include <filesystem>
#include <tuple>

#include "pipeline/check/border_laws.h"
#include "pipeline/check/check.h"
#include "pipeline/check/error_laws.h"
#include "pipeline/check/folder_documents.h"
#include "pipeline/tileset/implicit_tile.h"
#include "pipeline/tileset/manifest_json.h"
#include "proto/files.h"
#include "proto/numbers.h"

namespace cordillera::pipeline::check {
namespace {

namespace fs = std::filesystem;

// No .glb step is written into a folder. Errors are measured on .drc tiles alone, whose step this stands for: next to nothing.
constexpr double kNoRounding_m = 0x1p-20;

std::string bytes_of(const fs::path& path) { return proto::bytes_of_file(path).value_or(""); }

/// tiles/z/x/y.drc of a level, by y, then by x.
std::vector<proto::TileAddress> drc_tiles(const fs::path& folder, int level) {
  std::vector<proto::TileAddress> found;
  std::error_code error;
  for (const auto& column : fs::directory_iterator(folder / "tiles" / std::to_string(level), error)) {
    const auto x = proto::number<std::int32_t>(column.path().filename().string());
    for (const auto& file : fs::directory_iterator(column.path(), error)) {
      const auto y = proto::number<std::int32_t>(file.path().stem().string());
      if (x && y && file.path().extension() == ".drc") found.push_back({level, *x, *y});
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return std::tie(a.y, a.x) < std::tie(b.y, b.x); });
  return found;
}

/// The .glb of a tile stands below its hemisphere.
fs::path glb_path(const fs::path& folder, const proto::TileAddress& tile) {
  return folder / "tiles" / std::string(1, hemisphere_of(tile)) / std::to_string(tile.z) / std::to_string(implicit_x(tile)) /
         (std::to_string(tile.y) + ".glb");
}

/// What all levels are checked with.
struct Checking {
  ErrorLaws* errors = nullptr;  ///< may be null
  FolderDocuments& documents;
  Teller& progress;
  Report& report;
};

void check_level(const fs::path& folder, const proto::Manifest& manifest, const proto::LevelSummary& level,
                 const Checking& with) {
  Report& report = with.report;
  const int z = static_cast<int>(level.level());
  const std::string where = "level " + std::to_string(z);
  BorderLaws borders(z, report);
  std::uint64_t triangles = 0;
  const auto tiles = drc_tiles(folder, z);
  for (const proto::TileAddress& at : tiles) {
    const std::string drc =
        bytes_of(folder / "tiles" / std::to_string(z) / std::to_string(at.x) / (std::to_string(at.y) + ".drc"));
    const std::string glb = bytes_of(glb_path(folder, at));
    with.progress.tell(static_cast<double>(++report.tiles));
    with.documents.add(at);
    auto tile =
        check_tile({at, static_cast<int>(manifest.max_level()), drc, glb, nullptr, 0, level.height_step()}, report.findings);
    if (!tile) continue;
    triangles += tile->drc.triangles.size();
    if (with.errors != nullptr) with.errors->add(*tile, level.stated_max_error(), report);
    borders.add(*tile);
  }
  borders.finish();
  if (tiles.size() != level.tiles()) {
    report.findings.add(where, "the manifest counts " + std::to_string(level.tiles()) + " tiles, " +
                                   std::to_string(tiles.size()) + " .drc files are there");
  } else if (triangles != level.triangles()) {
    report.findings.add(where, "the manifest counts " + std::to_string(level.triangles()) + " triangles, the tiles have " +
                                   std::to_string(triangles));
  }
}

}  // namespace

proto::Result<Report> check_folder(const std::string& folder, const OpenRasters& rasters, const ProgressCallback& progress) {
  const auto manifest = manifest_of_folder(folder);
  if (!manifest || manifest->levels_size() == 0) {
    return proto::Problem{"file-unreadable", folder + "/manifest.json is no manifest", "a folder that `cordillera build` wrote",
                          "path"};
  }
  std::error_code error;
  if (!fs::exists(fs::path(folder) / "tiles" / "E", error) && !fs::exists(fs::path(folder) / "tiles" / "W", error)) {
    return proto::Problem{"file-unreadable",
                          folder + " holds no .glb tiles; only those of `build` with its usual formats can be checked",
                          "a folder with drc and 3d-tiles, or the dataset's .sqlite file", "path"};
  }
  proto::Plan plan;
  plan.set_finest_level(manifest->max_level());
  *plan.mutable_options() = manifest->options();  // pixels= says which samples the tiles were made of
  for (const proto::LevelSummary& level : manifest->levels()) {
    proto::LevelPlan& planned = *plan.add_levels();
    planned.set_level(level.level());
    planned.set_target(level.target());
    planned.set_ecef_step(kNoRounding_m);
  }
  std::unique_ptr<ErrorLaws> errors;
  if (rasters) {
    auto opened = ErrorLaws::open(rasters, *manifest, plan);
    if (!opened) return opened.problem();
    errors = std::move(*opened);
  }
  Report report;
  FolderDocuments documents(folder, report);
  double total = 0;
  for (const proto::LevelSummary& level : manifest->levels()) total += level.tiles();
  Teller told(progress);
  told.stage("tiles", total);
  for (const proto::LevelSummary& level : manifest->levels())
    check_level(folder, *manifest, level, {errors.get(), documents, told, report});
  if (errors) errors->finish(manifest->source(), report);
  return report;
}

}  // namespace cordillera::pipeline::check
