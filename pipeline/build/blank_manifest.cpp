#include "pipeline/build/blank_manifest.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <utility>

#include "pipeline/build/water_build.h"
#include "pipeline/encode/encode.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/water_mask.h"
#include "pipeline/tile/tile_error.h"
#include "proto/ellipsoid.h"
#include "proto/integers.h"
#include "proto/lattice.h"
#include "proto/utf8.h"
#include "raster/pixels/decimation.h"
#include "raster/place/area.h"
#include "raster/sample/back_projection.h"
#include "raster/voids/cut_voids.h"
#include "raster/voids/filled_source.h"

namespace cordillera::pipeline {
namespace {

/// crs and bbox stay as they were asked for: without them the source's own are in effect, and those are in the manifest's source.
proto::BuildOptions effective(const BuildRequest& request, const proto::Plan& plan, const proto::Source& source,
                              const Machine& machine) {
  proto::BuildOptions options = request.options;
  if (options.keep_size() == 0) options.set_error(plan.levels(0).target());
  options.set_vertical_datum(source.vertical_datum());
  if (options.voids().empty()) options.set_voids("fill");
  if (options.voids() == "fill") options.set_fill_limit(raster::fill_limit_cells(options));
  options.clear_warnings();
  options.set_strategy(strategy_of(plan));
  if (options.quality().empty()) options.set_quality("default");
  options.set_pixels(pixels_within_m(plan) > 0 ? raster::kExactPixels : raster::kLatticePixels);
  options.set_device(machine.device.substr(0, machine.device.find(' ')));
  options.set_threads(machine.threads);
  options.set_min_level(plan.min_level());
  options.set_max_level(plan.finest_level());
  options.set_water_mask(water_mask_name(options));
  if (plan.options().has_water()) options.set_water(plan.options().water());
  if (!options.has_z_scale()) options.set_z_scale(1);
  if (!options.has_z_offset()) options.set_z_offset(0);
  return options;
}

}  // namespace

std::optional<std::string> note_on_voids(const std::vector<raster::MosaicMember>& members) {
  constexpr std::size_t kMostNamed = 5;
  std::size_t count = 0;
  std::string named;
  for (const raster::MosaicMember& member : members) {
    if (!member.description.all_void() || ++count > kMostNamed) continue;
    named += (named.empty() ? "" : ", ") + proto::as_utf8(member.name);
  }
  if (count == 0) return std::nullopt;
  return std::to_string(count) + " of " + std::to_string(members.size()) + (count == 1 ? " rasters has" : " rasters have") +
         " no data, which is no height within 16384 m of zero: " + named + (count > kMostNamed ? ", …" : "");
}

std::optional<std::string> note_on_hidden(const std::vector<raster::MosaicMember>& members) {
  constexpr double kFiner = 1.5;
  const auto covers = [](const proto::Source& above, const proto::Source& below) {
    if (above.pixel_height_m() <= kFiner * below.pixel_height_m()) return false;
    const auto a = raster::area_of(above.bbox()), b = raster::area_of(below.bbox());
    return a && b && a->west_deg <= b->west_deg && a->south_deg <= b->south_deg && a->east_deg >= b->east_deg &&
           a->north_deg >= b->north_deg;
  };
  std::size_t count = 0;
  std::string first;
  for (auto one = members.begin(); one != members.end(); ++one) {
    const auto above =
        std::find_if(members.begin(), one, [&](const auto& before) { return covers(before.description, one->description); });
    if (above == one || ++count > 1) continue;
    first = proto::as_utf8(one->name) + " is finer than " + proto::as_utf8(above->name) +
            ", which is named before it, covers it and is shown in its place; to show it, name it first";
  }
  if (count == 0) return std::nullopt;
  return first + (count == 1 ? "" : " (and " + std::to_string(count - 1) + " more)");
}

namespace {

/// Where somebody asks for less than the points of .glb tiles can tell.
std::string note_on_rounding(const proto::Plan& plan) {
  const proto::LevelPlan& finest = plan.levels(0);
  const proto::Lattice lattice = lattice_of(plan);
  const auto middle = [&](int side, std::int64_t circle) {
    const std::int64_t at = (std::int64_t{plan.window(side)} + plan.window(side + 2)) / 2;
    return static_cast<std::int32_t>(proto::modulo(at, circle) / lattice.tile_units(lattice.finest_level));
  };
  const double rounding =
      rounding_m(finest, lattice, {lattice.finest_level, middle(0, lattice.columns()), middle(1, lattice.rows())});
  if (plan.options().keep_size() > 0 || finest.target() >= rounding) return "";
  char text[200];
  std::snprintf(
      text, sizeof text,
      "an error of %.3g m is less than the rounding of .glb points on tiles as wide as these, some %.2g m: what came out "
      "is stated",
      finest.target(), rounding);
  return text;
}

std::string note_on_sea(const BuildRequest& request, const proto::Plan& plan) {
  if (request.options.has_water() || !plan.options().has_water()) return "";
  return "still water of exactly 0 m is taken for the sea; water=none takes it for land";
}

/// A sparse file may have left out zeros, or what was never written; a VRT names rasters that leave gaps.
std::string note_on_unstored(const proto::Manifest& manifest, const std::string& voids) {
  const auto lacks_blocks = [](const proto::Source& source) { return source.nodata() == raster::kUnstoredBlocks; };
  const bool open = voids.empty() || voids == "fill" || voids == "hole";
  if (!open || !(lacks_blocks(manifest.source()) || std::ranges::any_of(manifest.sources(), lacks_blocks))) return "";
  return "pixels that a file never stored, or that no raster of a VRT covers, are voids, and other programs read 0 there, for it "
         "declares no nodata value; voids=0 makes them ground at height 0";
}

}  // namespace

std::optional<raster::ValueLook> look_at_values(raster::Source& source) {
  const auto pixels = source.decimate(raster::kPixelsLookedAt);
  if (!pixels.ok() || *pixels == nullptr) return std::nullopt;  // several rasters, or too much of one to be decoded
  return (*pixels)->look;
}

std::optional<raster::ValueLook> look_at_values(const std::vector<raster::MosaicMember>& members) {
  constexpr std::size_t kMostOpened = 64;  // more are no quick look
  if (members.empty() || members.size() > kMostOpened) return std::nullopt;
  raster::ValueLook all;
  for (const raster::MosaicMember& member : members) {
    if (member.description.vertical_datum() != members.front().description.vertical_datum()) return std::nullopt;
    const auto source = raster::open_source(member.path, member.name, member.trust, member.options);
    if (!source.ok()) return std::nullopt;
    const auto pixels = (*source)->decimate(raster::kPixelsLookedAt / static_cast<std::int64_t>(members.size()));
    if (!pixels.ok() || *pixels == nullptr) return std::nullopt;
    raster::add((*pixels)->look, all);
  }
  return all;
}

void note_values(const std::optional<raster::ValueLook>& look, proto::Manifest& manifest) {
  if (!look) return;
  for (const std::string& note : raster::notes_on(*look)) manifest.add_notes(note);
}

void note_cut_voids(raster::Source& source, const proto::Plan& plan, proto::Manifest& manifest) {
  const auto& bbox = plan.options().bbox();
  if (bbox.empty() || raster::fill_limit_cells(plan.options()) == 0) return;
  const auto cut = raster::cuts_voids(source, lattice_of(plan), {bbox.data(), static_cast<std::size_t>(bbox.size())});
  if (cut.ok() && *cut)
    manifest.add_notes(
        "voids that a side of the bbox cuts stay open, also those that the raster beyond it encloses: a wider bbox fills them");
}

proto::Manifest blank_manifest(const BuildRequest& request, const proto::Plan& plan, const proto::Source& source,
                               const Machine& machine) {
  proto::Manifest manifest;
  manifest.set_id(proto::as_utf8(request.id));
  manifest.set_name(proto::as_utf8(request.options.name().empty() ? request.raster_name : request.options.name()));
  manifest.set_title(request.options.title().empty() ? manifest.name() : request.options.title());
  manifest.set_attribution(request.options.attribution());
  manifest.set_program(plan.program());
  *manifest.mutable_source() = source;
  for (const raster::MosaicMember& member : request.members) *manifest.add_sources() = member.description;
  *manifest.mutable_notes() = request.options.warnings();
  for (auto note : {note_on_voids(request.members), note_on_hidden(request.members)})
    if (note) manifest.add_notes(std::move(*note));
  if (std::string note = note_on_rounding(plan); !note.empty()) manifest.add_notes(std::move(note));
  if (std::string note = note_on_mask(request.options, source); !note.empty()) manifest.add_notes(std::move(note));
  if (std::string note = note_on_sea(request, plan); !note.empty()) manifest.add_notes(std::move(note));
  if (std::string note = note_on_unstored(manifest, request.options.voids()); !note.empty()) manifest.add_notes(std::move(note));
  *manifest.mutable_options() = effective(request, plan, source, machine);
  manifest.mutable_options()->set_name(manifest.name());
  manifest.mutable_options()->set_title(manifest.title());
  if (request.at_once) manifest.set_at_once(true);
  manifest.set_min_level(plan.min_level());
  manifest.set_max_level(plan.finest_level());
  const proto::Lattice lattice = lattice_of(plan);
  manifest.set_cell_m(proto::cell_height_m(lattice, (plan.window(1) + plan.window(3)) / 2));
  manifest.set_height_datum("WGS 84 ellipsoid");
  manifest.set_drc_formula(kDrcFormula);
  // Where data goes around the earth the last column is the first one.
  manifest.mutable_source()->set_lattice_samples(static_cast<double>(std::min(columns_of(plan), lattice.columns())) *
                                                 static_cast<double>(rows_of(plan)));
  return manifest;
}

}  // namespace cordillera::pipeline
