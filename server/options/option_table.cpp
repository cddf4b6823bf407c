// The entries of the option table that a build or a POST has. Help and accepted values are written once, here.
#include <algorithm>
#include <array>
#include <iterator>
#include <limits>

#include "gpu/simplify.h"
#include "pipeline/plan/plan.h"
#include "pipeline/plan/plan_options.h"
#include "proto/lattice.h"
#include "proto/letters.h"
#include "proto/mesh.h"
#include "raster/sample/back_projection.h"
#include "raster/voids/filled_source.h"
#include "raster/voids/void_height.h"
#include "server/memory/memory_limit.h"
#include "server/options/options.h"

namespace cordillera::server {
namespace {

constexpr double kGreatest = std::numeric_limits<double>::max();

Complaint apply_error(std::string_view text, Settings& settings) {
  double value = 0;
  if (auto complaint = read_number(text, {pipeline::kLeastError_m, pipeline::kGreatestError_m}, &value)) return complaint;
  settings.build.set_error(value);
  settings.build.clear_keep();
  return std::nullopt;
}

Complaint apply_keep(std::string_view text, Settings& settings) {
  std::vector<double> shares;
  if (auto complaint = read_numbers(text, {0, 1}, &shares)) return complaint;
  if (auto wrong = pipeline::wrong_with_keep(shares)) return wrong;
  settings.build.mutable_keep()->Assign(shares.begin(), shares.end());
  settings.build.clear_error();
  return std::nullopt;
}

Complaint apply_datum(std::string_view text, Settings& settings) {
  std::string value;
  if (!read_choice(text, {"EGM96", "EGM2008", "EGM84", "ellipsoid"}, &value)) {
    settings.build.set_vertical_datum(value);
    return std::nullopt;
  }
  if (auto complaint = read_text(text, &value)) return complaint;
  if (value.empty()) return "empty";
  settings.build.set_vertical_datum(value);
  return std::nullopt;
}

Complaint apply_voids(std::string_view text, Settings& settings) {
  std::string value;
  if (!read_choice(text, {"fill", "hole"}, &value)) {
    settings.build.set_voids(value);
    return std::nullopt;
  }
  if (text.empty()) return "empty";
  const std::string height(proto::trimmed(text, " "));  // a "+" in an address is a space
  if (const auto height_m = raster::void_height_m(height); !height_m) return height_m.problem().detail;
  settings.build.set_voids(height);
  return std::nullopt;
}

/// Text that is no words for people: nothing is meant where it is empty.
template <std::string* (proto::BuildOptions::*field)()>
Complaint apply_named(std::string_view text, Settings& settings) {
  return text.empty() ? Complaint("empty") : read_text(text, (settings.build.*field)());
}

Complaint apply_band(std::string_view text, Settings& settings) {
  std::string value;
  if (auto complaint = read_text(text, &value)) return complaint;
  if (value.empty()) return "empty";
  if (value == "0" || value[0] == '-') return "bands are counted from 1";
  settings.build.set_band(value);
  return std::nullopt;
}

Complaint apply_nodata(std::string_view text, Settings& settings) {
  double value = 0;
  std::string word;
  if (!read_choice(text, {"nan"}, &word)) {
    settings.build.set_nodata(word);
    return std::nullopt;
  }
  if (auto complaint = read_number(text, {-kGreatest, kGreatest}, &value)) return "neither a number nor nan";
  settings.build.set_nodata(shown(value));
  return std::nullopt;
}

Complaint apply_bbox(std::string_view text, Settings& settings) {
  std::array<double, 4> box{};
  if (auto complaint = read_box(text, &box)) return complaint;
  settings.build.mutable_bbox()->Assign(box.begin(), box.end());
  return std::nullopt;
}

Complaint apply_memory(std::string_view text, Settings& settings) {
  std::uint32_t value = 0;
  if (auto complaint = read_whole(text, {0, 1u << 24}, &value)) return complaint;
  if (value != 0 && value < kMemoryPerThread_mib)
    return "less than " + std::to_string(kMemoryPerThread_mib) + ", which one thread takes";
  settings.build.set_memory(value);
  return std::nullopt;
}

Complaint apply_z_scale(std::string_view text, Settings& settings) {
  double value = 0;
  if (auto complaint = read_number(text, {-1e6, 1e6}, &value)) return complaint;
  if (value == 0) return "0 would flatten everything";
  settings.build.set_z_scale(value);
  return std::nullopt;
}

using proto::BuildOptions;

template <std::string* (BuildOptions::*field)()>
Complaint apply_text(std::string_view text, Settings& settings) {
  return read_text(text, (settings.build.*field)());
}

template <void (BuildOptions::*set)(std::uint32_t), std::uint32_t greatest>
Complaint apply_whole(std::string_view text, Settings& settings) {
  std::uint32_t value = 0;
  if (auto complaint = read_whole(text, {0, greatest}, &value)) return complaint;
  (settings.build.*set)(value);
  return std::nullopt;
}

template <void (BuildOptions::*set)(double), int least, int greatest>
Complaint apply_number(std::string_view text, Settings& settings) {
  double value = 0;
  if (auto complaint = read_number(text, {least, greatest}, &value)) return complaint;
  (settings.build.*set)(value);
  return std::nullopt;
}

Complaint apply_water(std::string_view text, Settings& settings) {
  constexpr int kHeight_m = static_cast<int>(proto::kMaxHeight_m);
  settings.build.clear_water();
  settings.build.clear_no_water();
  if (text != "none") return apply_number<&BuildOptions::set_water, -kHeight_m, kHeight_m>(text, settings);
  settings.build.set_no_water(true);
  return std::nullopt;
}

/// What each of several rasters may have of its own.
constexpr std::string_view kOfRaster[] = {"name", "band", "crs", "vertical-datum", "nodata", "voids", "z-scale", "z-offset"};

std::vector<OptionSpec> make_build_options() {
  constexpr std::uint32_t kLevel = proto::kMaxLevel;
  const std::string level = "a level from 0 to " + std::to_string(kLevel);
  const std::string thread_mib = std::to_string(kMemoryPerThread_mib);
  return {
      {"name", "NAME", "what the raster is called; an .hgt knows its place only by this", "text, such as N44W072.hgt",
       apply_text<&BuildOptions::mutable_name>},
      {"band", "BAND", "which band of the file holds the heights, or which of several rasters in it (NetCDF, GeoPackage)",
       "a number from 1 on, or a name: a band's, a variable's or a table's", apply_band},
      {"error", "METRES", "greatest deviation allowed at the finest level; doubles a level upwards", "metres, 0.01 to 1000000",
       apply_error},
      {"keep", "SHARES", "shares of the finest grid's triangles, finest level first; the last ratio is repeated",
       "numbers above 0 up to 1, falling, separated by commas: 0.5,0.25,0.1", apply_keep},
      {"crs", "CRS", "coordinate system of a raster that names none", "anything PROJ understands, such as EPSG:32632 or WKT",
       apply_named<&BuildOptions::mutable_crs>},
      {"vertical-datum", "DATUM", "what the raster's heights are above, if it does not say so itself",
       "EGM96, EGM2008, EGM84, ellipsoid, a height system by name or code such as NAVD88 or EPSG:5703, or a geoid grid file "
       "(over HTTP: "
       "the bare name of one in the operator's geoid folders)",
       apply_datum},
      {"nodata", "VALUE",
       "a value of the raster that means no data, beside the one that the file declares; before scale and offset",
       "a number as it stands in the file, such as -9999, or nan", apply_nodata, "source-nodata"},
      {"voids", "WHAT", "what becomes of places without data: fill closes those that data encloses with a smooth surface",
       "fill, hole, or a height in metres, -500 to 16384, that is put there (of one raster among several: a height)",
       apply_voids},
      {"fill-limit", "CELLS", "voids that are wider or higher than this, in cells of the finest level, are not filled",
       "0 to 1024", apply_whole<&BuildOptions::set_fill_limit, raster::kGreatestFillLimit_cells>},
      {"water", "HEIGHT",
       "pixels of exactly this height, in metres above the vertical datum, are water: pictures show it flat, quantized-mesh has "
       "masks",
       "a height in metres, -16384 to 16384, or none", apply_water},
      {"water-mask",
       "FILE",
       "a raster in any CRS that is not zero where water is, in place of water; on the command line only",
       "a single-band raster that GDAL can read",
       apply_text<&BuildOptions::mutable_water_mask>,
       {},
       OpenTo::operators},
      {"strategy", "NAME",
       "how meshes are simplified; auto, exact: large blocks, no sample ever farther off than the error; cleap and sequential: "
       "tiles by the published algorithm, to be compared with",
       "auto, exact, cleap or sequential",
       [](std::string_view text, Settings& settings) {
         std::vector<std::string> names{pipeline::kAutoStrategy};
         names.insert(names.end(), gpu::kStrategies.begin(), gpu::kStrategies.end());
         return read_choice(text, names, settings.build.mutable_strategy());
       }},
      {"quality", "QUALITY", "with error: fast leaves out what makes the triangles fewer, best takes more time for it",
       "fast, default or best",
       [](std::string_view text, Settings& settings) {
         return read_choice(text, {pipeline::kQualities.begin(), pipeline::kQualities.end()}, settings.build.mutable_quality());
       }},
      {"pixels", "PIXELS",
       "exact: the finest level keeps its error at the raster's own pixels, too; lattice: at the samples of the level alone, "
       "with fewer triangles, as do levels of cells wider than a pixel and keep=",
       "exact or lattice",
       [](std::string_view text, Settings& settings) {
         return read_choice(text, {raster::kExactPixels, raster::kLatticePixels}, settings.build.mutable_pixels());
       }},
      {"device", "DEVICE", "what computes; auto: a GPU, where there is one and the raster is large enough to open it for",
       "auto, cpu, cuda or cuda:N",
       [](std::string_view text, Settings& settings) { return read_device(text, settings.build.mutable_device()); }},
      {"threads", "N", "threads of a build; 0: one for each usable core", "0 to 1024",
       apply_whole<&BuildOptions::set_threads, 1024>},
      {"memory", "MIB",
       "memory a build may use on top of the program, MiB; takes a thread for each " + thread_mib +
           " MiB at most; 0: the default",
       "0, or " + thread_mib + " to 16777216", apply_memory},
      {"bbox", "W,S,E,N", "build only this box, degrees; west above east crosses the antimeridian",
       "west,south,east,north in degrees, longitudes -180 to 180, latitudes -90 to 90", apply_bbox},
      {"min-level", "LEVEL", "coarsest level to publish", level, apply_whole<&BuildOptions::set_min_level, kLevel>},
      {"max-level", "LEVEL", "finest level; default: the first that is as fine as the raster", level,
       apply_whole<&BuildOptions::set_max_level, kLevel>},
      {"z-scale", "FACTOR", "height = z-scale * value + z-offset, after the source's own scale and unit", "a number, not 0",
       apply_z_scale},
      {"feather", "METRES", "width over which one of several rasters gives way to the next, at its rims and voids", "0 to 100000",
       apply_number<&BuildOptions::set_feather, 0, 100000>},
      {"z-offset", "METRES", "see z-scale", "metres", apply_number<&BuildOptions::set_z_offset, -1000000, 1000000>},
      {"title", "TEXT", "title carried into manifest, tileset, status and every .glb", "text",
       apply_text<&BuildOptions::mutable_title>},
      {"attribution", "TEXT", "attribution carried into manifest, tileset, status and every .glb", "text",
       apply_text<&BuildOptions::mutable_attribution>},
      {"imagery", "ADDRESS",
       "tiles of pictures that viewer and client pages lay on the terrain; named in manifest, tileset and status", kImagery,
       [](std::string_view text, Settings& settings) { return read_imagery(text, settings.build.mutable_imagery()); }},
      {"dry-run", "", "say levels, tiles, bytes and time expected; build nothing", "1 or 0",
       [](std::string_view text, Settings& settings) { return read_switch(text, &settings.dry_run); }},
  };
}

std::vector<OptionSpec> make_posting_options() {
  return {
      {"private", "", "let only those read the dataset who have a token", "1 or 0",
       [](std::string_view text, Settings& settings) { return read_switch(text, &settings.private_dataset); }},
      {"provisional", "SWITCH", "show coarse tiles of a raster soon after it was posted, until its build is done", "on or off",
       [](std::string_view text, Settings& settings) {
         bool shown = true;
         auto complaint = read_switch(text, &shown);
         if (!complaint) settings.build.set_provisional(shown);
         return complaint;
       }},
      {"build", "BLOCKS",
       "make all blocks of a raster at once, or each when one of its tiles is asked for; of an address (source=) lazy is the "
       "default",
       "full or lazy", [](std::string_view text, Settings& settings) {
         std::string blocks;
         auto complaint = read_choice(text, {"full", "lazy"}, &blocks);
         if (!complaint) settings.build.set_build(blocks);
         return complaint;
       }}};
}

}  // namespace

const std::vector<OptionSpec>& build_options() {
  static const std::vector<OptionSpec> table = make_build_options();
  return table;
}

std::vector<OptionSpec> raster_options() {
  std::vector<OptionSpec> own;
  std::copy_if(build_options().begin(), build_options().end(), std::back_inserter(own), [](const OptionSpec& option) {
    return std::find(std::begin(kOfRaster), std::end(kOfRaster), option.name) != std::end(kOfRaster);
  });
  return own;
}

const std::vector<OptionSpec>& posting_options() {
  static const std::vector<OptionSpec> table = make_posting_options();
  return table;
}

}  // namespace cordillera::server
