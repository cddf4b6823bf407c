#include "pipeline/store/store_publish.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/encode/encode.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/levels_shown.h"
#include "pipeline/store/pixel_error_sum.h"
#include "pipeline/store/store_schema.h"
#include "proto/degrees.h"
#include "proto/lattice.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {
namespace {

double blob_bytes(Database& database, const std::string& which) {
  Statement sum(database, "SELECT total(length(bytes)) FROM blobs WHERE hash IN (" + which + ")");
  return sum.step() ? sum.real(0) : 0;
}

/// Least and greatest of the samples that a level's tiles cover.
struct SampleRange {
  double lowest_m = INFINITY, highest_m = -INFINITY;
  void add(const proto::TileRecord& tile) {
    if (!tile.has_lowest_sample()) return;
    lowest_m = std::min(lowest_m, tile.lowest_sample());
    highest_m = std::max(highest_m, tile.highest_sample());
  }
};

/// What the published triangles of a level's tiles cover; none: nobody knows of one of them.
using ShownArea = std::optional<double>;

proto::TileRecord record_in(std::string_view bytes) {
  proto::TileRecord tile;
  if (!tile.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) throw StoreError("a tile record is damaged");
  return tile;
}

void add_counts(const proto::TileRecord& tile, proto::LevelSummary& sum, PixelErrorSum& pixels) {
  if (tile.has_pixels()) pixels.add(tile.pixels());
  sum.set_uncovered_samples(sum.uncovered_samples() + tile.uncovered());
  sum.set_valid_samples(sum.valid_samples() + tile.valid_samples());
  sum.set_flat_samples(sum.flat_samples() + tile.flat_samples());
  sum.set_filled_samples(sum.filled_samples() + tile.filled_samples());
}

/// Data of tiles without a triangle counts, too.
void add_lost(Database& database, proto::LevelSummary& sum, PixelErrorSum& pixels, std::uint32_t level) {
  if (!Statement(database, "SELECT 1 FROM sqlite_master WHERE name = 'lost'").step()) return;
  Statement rows(database, "SELECT record FROM lost WHERE level = ? ORDER BY y, x");
  rows.bind(level);
  while (rows.step()) add_counts(record_in(rows.blob(0)), sum, pixels);
}

// Records come ordered by place, so that sums of doubles are the same in every build.
proto::LevelSummary level_summary(Database& database, const proto::LevelPlan& plan, SampleRange& range, PixelErrorSum& pixels,
                                  ShownArea& shown) {
  proto::LevelSummary sum;
  double squares = 0, samples = 0;
  shown = 0;
  Statement rows(database, "SELECT record FROM tiles WHERE level = ? ORDER BY y, x");
  rows.bind(plan.level());
  while (rows.step()) {
    const proto::TileRecord tile = record_in(rows.blob(0));
    const bool first = sum.tiles() == 0;
    sum.set_min_height(first ? tile.min_height() : std::min(sum.min_height(), tile.min_height()));
    sum.set_max_height(first ? tile.max_height() : std::max(sum.max_height(), tile.max_height()));
    range.add(tile);
    add_counts(tile, sum, pixels);
    sum.set_tiles(sum.tiles() + 1);
    sum.set_triangles(sum.triangles() + tile.triangles());
    sum.set_vertices(sum.vertices() + tile.vertices());
    sum.set_stated_max_error(std::max(sum.stated_max_error(), tile.max_error()));
    sum.set_overcovered_samples(sum.overcovered_samples() + tile.overcovered());
    sum.set_composed(sum.composed() || tile.composed());
    sum.set_border_vertices(sum.border_vertices() + tile.border_vertices());
    sum.set_put_back(sum.put_back() + tile.put_back());
    shown = shown && tile.has_shown() ? ShownArea(*shown + tile.shown()) : std::nullopt;
    squares += tile.sum_squared_error();
    samples += tile.samples();
  }
  add_lost(database, sum, pixels, plan.level());
  const std::string level = std::to_string(plan.level());
  sum.set_level(plan.level());
  sum.set_tolerance(plan.target());
  if (samples > 0) sum.set_rmse(std::sqrt(squares / samples));
  sum.set_drc_bytes(blob_bytes(database, "SELECT drc FROM tiles WHERE level = " + level));
  sum.set_glb_bytes(blob_bytes(database, "SELECT glb FROM tiles WHERE level = " + level));
  return sum;
}

/// areas: indexed as levels.
void set_shown_shares(const std::vector<ShownArea>& areas, proto::Manifest& manifest) {
  const auto finest = std::find_if(areas.begin(), areas.end(), [](const ShownArea& area) { return !area || *area > 0; });
  if (finest == areas.end() || !*finest) return;
  for (std::size_t k = 0; k < areas.size(); ++k) {
    if (areas[k]) manifest.mutable_levels(static_cast<int>(k))->set_shown_share(std::min(*areas[k] / **finest, 1.0));
  }
}

constexpr int kBounds = 6;  // of a manifest: west, south, east, north, and the heights

struct Longitudes {
  double west_deg = -180, east_deg = 180;
};

// The shortest stretch of longitudes that holds all tiles of a level: what is left of the circle without the widest stretch that
// is empty from one column of tiles to the next. A coarse level may have tiles in every column and yet be nearly empty. west >
// east where it crosses the antimeridian.
Longitudes longitudes(Database& database, int level) {
  constexpr double kRounded_deg = 1e-9;
  std::vector<Longitudes> columns;
  Statement rows(database, "SELECT min(west), max(east) FROM tiles WHERE level = ? GROUP BY x ORDER BY x");
  rows.bind(level);
  while (rows.step()) columns.push_back({rows.real(0) * proto::kRadian_deg, rows.real(1) * proto::kRadian_deg});
  if (columns.empty()) return {};
  // What ends on either side of the antimeridian goes first where there is as much.
  double widest_deg = columns.front().west_deg + 360 - columns.back().east_deg;
  Longitudes out;
  if (widest_deg > kRounded_deg) out = {columns.front().west_deg, columns.back().east_deg};
  for (std::size_t k = 1; k < columns.size(); ++k) {
    const double gap_deg = columns[k].west_deg - columns[k - 1].east_deg;
    if (gap_deg <= widest_deg + kRounded_deg) continue;
    widest_deg = gap_deg;
    out = {columns[k].west_deg, columns[k - 1].east_deg};
  }
  return out;
}

void add_bounds(Database& database, int level, proto::Manifest& manifest) {
  Statement box(database, "SELECT min(south), max(north) FROM tiles WHERE level = ?");
  box.bind(level);
  box.step();
  const Longitudes lon = longitudes(database, level);
  manifest.clear_bounds();
  for (const double degrees : {lon.west_deg, box.real(0) * proto::kRadian_deg, lon.east_deg, box.real(1) * proto::kRadian_deg})
    manifest.add_bounds(degrees);
}

// What the source turned out to hold, from the finest level's sums.
void describe_source(const proto::LevelSummary& finest, const SampleRange& range, proto::Source& source) {
  if (source.lattice_samples() > 0) source.set_nodata_share(std::max(0.0, 1 - finest.valid_samples() / source.lattice_samples()));
  if (finest.valid_samples() > 0) {
    source.set_flat_water_share(finest.flat_samples() / finest.valid_samples());
    source.set_filled_share(finest.filled_samples() / finest.valid_samples());
  }
  if (range.lowest_m > range.highest_m) return;
  source.set_min_height(range.lowest_m);
  source.set_max_height(range.highest_m);
}

void note_once(const std::string& text, proto::Manifest& manifest) {
  const auto& notes = manifest.notes();
  if (std::find(notes.begin(), notes.end(), text) == notes.end()) manifest.add_notes(text);
}

/// How much of the data nobody measured.
void note_filled(double share, proto::Manifest& manifest) {
  if (share <= 0) return;
  char text[160];
  const double percent = 100 * share;
  const char* format = percent < 0.01 ? "Less than 0.01 %% of the data were voids and are filled; voids=hole keeps them"
                       : percent < 10 ? "%.2g %% of the data were voids and are filled; voids=hole keeps them"
                                      : "%.0f %% of the data were voids and are filled; voids=hole keeps them";
  std::snprintf(text, sizeof text, format, percent);
  note_once(text, manifest);  // a check sums up what is published already
}

/// The target holds at samples. Where some pixels are far from it all the same, that is said.
void note_pixels(const PixelErrorSum& pixels, double target_m, proto::Manifest& manifest) {
  constexpr double kFar = 1.25;
  const proto::ErrorAtPixels& errors = manifest.source().error_at_pixels();
  if (!(errors.max() > kFar * target_m)) return;
  char text[200];
  std::snprintf(text, sizeof text,
                "%.0f of %.0f pixels are farther from the finest level than its target of %.3g m, the farthest %.4g m",
                std::max(1.0, pixels.beyond(target_m)), errors.pixels(), target_m, errors.max());
  manifest.add_notes(text);
}

/// Rims may move by a cell, and data of a few cells may be gone. shown_share is a share of what the finest level shows, and does
/// not tell.
void note_uncovered(const proto::ErrorAtPixels& errors, int finest_level, proto::Manifest& manifest) {
  constexpr double kMost = 0.5;
  const double all = errors.pixels() + errors.uncovered();
  if (!(errors.uncovered() > kMost * all)) return;
  char text[200];
  std::snprintf(
      text, sizeof text,
      "%.0f of %.0f pixels with data are under no triangle of the finest level, where rims may move by one of its cells",
      errors.uncovered(), all);
  const std::string finer =
      finest_level < proto::kMaxLevel ? "; max_level=" + std::to_string(finest_level + 1) + " keeps more of them" : std::string();
  manifest.add_notes(text + finer);
}

/// The raster's words and what was used in their place. Of several rasters each pair once.
void note_datum(const proto::Source& source, proto::Manifest& manifest) {
  const std::string &declared = source.vertical_datum_declared(), &used = source.vertical_datum();
  if (!declared.empty() && !used.empty() && declared != used) note_once(declared + " declared, " + used + " used", manifest);
  if (source.datum_ignored())
    note_once("PROJ knows no way from the datum of " + source.crs() + " (" + source.horizontal_datum() +
                  ") to WGS 84, and takes it for that: places may be some hundred metres off",
              manifest);
}

/// What was noted when they were opened. Hundreds may have one mistake, each told with its name and place.
void note_sources(proto::Manifest& manifest) {
  constexpr int kMostNotes = 10;
  std::vector<std::string> notes;
  const auto collect = [&](const proto::Source& source) {
    for (const std::string& note : source.notes())
      if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
  };
  if (manifest.sources().empty()) collect(manifest.source());
  for (const proto::Source& source : manifest.sources()) collect(source);
  const std::size_t told = std::min<std::size_t>(notes.size(), kMostNotes);
  for (std::size_t k = 0; k < told; ++k) note_once(notes[k], manifest);
  if (told < notes.size())
    note_once(std::to_string(notes.size() - told) + " more notes stand with the rasters that they are of, in sources", manifest);
}

/// Rasters of several datums, each taken to WGS 84 as PROJ does, may not fit where they meet.
void note_horizontal_datums(proto::Manifest& manifest) {
  std::set<std::string> datums;
  for (const proto::Source& source : manifest.sources()) {
    if (!source.horizontal_datum().empty()) datums.insert(source.horizontal_datum());
  }
  if (datums.size() < 2) return;
  std::string names;
  for (const std::string& name : datums) names += (names.empty() ? "" : ", ") + name;
  note_once("The rasters have " + std::to_string(datums.size()) + " horizontal datums (" + names +
                "): where they meet they may be some metres apart",
            manifest);
}

}  // namespace

void note_datums(proto::Manifest& manifest) {
  if (manifest.sources().empty()) note_datum(manifest.source(), manifest);
  for (const proto::Source& source : manifest.sources()) note_datum(source, manifest);
  note_horizontal_datums(manifest);
  note_sources(manifest);
}

void make_nodes(Database& database, int finest_level) {
  database.execute(kCreateNodes);
  Statement fill(database, kFillNodes);
  for (int level = finest_level; level >= 0; --level) fill.bind(level).run();
}

void summarise(Database& database, const proto::Plan& plan, proto::Manifest& manifest) {
  // A provisional dataset that becomes sharper: its finest level is there in part, and says nothing of the whole.
  const bool sharper = manifest.provisional() && manifest.bounds_size() == kBounds;
  // Once, when it is published first: a check sums up what is there, and what earlier versions published has no such note.
  const bool first = manifest.levels_size() == 0;
  if (first) note_datums(manifest);
  manifest.clear_levels();
  double geometric_error = 0, triangles = 0, tiles = 0;
  const proto::LevelSummary* finest = nullptr;
  PixelErrorSum pixels;
  SampleRange range;  // of all levels: those that saw samples saw the same
  std::vector<ShownArea> shown;
  for (const proto::LevelPlan& level : plan.levels()) {
    proto::LevelSummary& sum = *manifest.add_levels();
    sum = level_summary(database, level, range, pixels, shown.emplace_back());
    sum.set_target(plan.promise() ? level.target()
                                  : sum.stated_max_error());  // shares of published algorithms promise none but what came out
    geometric_error = std::max(geometric_error, sum.stated_max_error());
    sum.set_geometric_error(geometric_error);
    sum.set_height_step(height_step(level) * proto::kHeightStep_m);
    tiles += sum.tiles();
    triangles += sum.triangles();
  }
  for (const proto::LevelSummary& sum : manifest.levels()) {
    if (sum.tiles() > 0 && finest == nullptr) finest = &sum;
  }
  if (finest == nullptr) throw NothingToPublish();
  if (!manifest.provisional()) set_shown_shares(shown, manifest);
  if (std::string note = note_on_sparse_levels(manifest); first && !note.empty()) manifest.add_notes(std::move(note));
  if (!sharper && !pixels.empty()) *manifest.mutable_source()->mutable_error_at_pixels() = pixels.total();
  if (first && !manifest.provisional()) note_uncovered(pixels.total(), plan.finest_level(), manifest);
  // Of provisional tiles no error is stated.
  if (first && !manifest.provisional() && !pixels.empty() && plan.options().keep_size() == 0)
    note_pixels(pixels, plan.levels(0).target(), manifest);
  if (sharper) {
    manifest.set_bounds(4, std::min(manifest.bounds(4), finest->min_height()));
    manifest.set_bounds(5, std::max(manifest.bounds(5), finest->max_height()));
  } else {
    describe_source(*finest, range, *manifest.mutable_source());
    note_filled(manifest.source().filled_share(), manifest);
    add_bounds(database, static_cast<int>(finest->level()), manifest);
    manifest.add_bounds(finest->min_height());
    manifest.add_bounds(finest->max_height());
  }
  manifest.set_tiles(static_cast<std::uint32_t>(tiles));
  manifest.set_triangles(static_cast<std::uint32_t>(std::min(triangles, 4294967295.0)));
  manifest.set_bytes(blob_bytes(database, "SELECT drc FROM tiles UNION SELECT glb FROM tiles"));
  manifest.set_min_level(plan.min_level());
  manifest.set_max_level(plan.finest_level());
  manifest.set_height_datum("WGS 84 ellipsoid");
  manifest.set_drc_formula(kDrcFormula);
}

}  // namespace cordillera::pipeline
