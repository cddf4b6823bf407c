// open_source: the checks in the order in which a user would want to hear of them.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "proto/utf8.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/pixels/decimation.h"
#include "raster/pixels/units.h"
#include "raster/place/crs.h"
#include "raster/place/crs_label.h"
#include "raster/source/raster_source.h"
#include "raster/voids/filled_source.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

/// Below this, pixels of a planet are a mistake in the georeference (degrees taken for metres).
constexpr double kSmallestPixel_m = 1e-3;

/// A raster that says nothing of its heights has those of the system asked for, also in their unit and direction. Returns the
/// z_scale= that would say the same: the band's unit counts more.
double take_axis_of(const VerticalCrs& asked, const Dataset& dataset, Crs& crs) {
  if (!crs.declared_datum.empty()) return 1;
  const HeightAxis axis = axis_of(asked);
  const bool unit_of_band = dataset.band->GetUnitType()[0] != '\0';
  const double metres = unit_of_band || !(axis.unit_m > 0) ? 1 : axis.unit_m;
  const double z_scale = axis.depth && !crs.depth ? -metres : metres;
  crs.height_unit = axis.unit;
  crs.height_unit_m = axis.unit_m;
  crs.depth = crs.depth || axis.depth;
  return z_scale;
}

proto::Result<HeightUnit> unit_of(const Dataset& dataset, const Crs& crs, bool z_scale_given) {
  const std::string band = dataset.band->GetUnitType();
  const std::string text = band.empty() ? crs.height_unit : band;
  if (text.empty()) return HeightUnit{"metre", 1};
  if (const auto unit = height_unit(text)) return *unit;
  const std::string shown = proto::shown_text(text);
  // "British foot (1936)", "yard": a CRS states a length beside the name.
  // Of a GeoTIFF GDAL gives its name to the band, too.
  if (text == crs.height_unit && crs.height_unit_m > 0) return HeightUnit{shown, crs.height_unit_m};
  if (z_scale_given) return HeightUnit{shown, 1};
  return Problem{"unit-unknown", "the heights of " + dataset.name + " are in \"" + shown + "\", a unit not known here",
                 std::string(kAcceptedUnits) + ", or z_scale= to say what takes them to metres", "z_scale"};
}

/// Heights are metres unless something says otherwise. Where the map counts in feet they are feet as often.
std::string note_on_feet(const Dataset& dataset, const Crs& crs) {
  if (!crs.horizontal.IsProjected() || dataset.band->GetUnitType()[0] != '\0' || !crs.height_unit.empty()) return "";
  const char* name = nullptr;
  const double metres = crs.horizontal.GetLinearUnits(&name);
  const auto unit = height_unit(text_of(name));
  if (!unit || !unit->name.ends_with("foot") || std::abs(metres - 0.3048) > 1e-4) return "";
  std::string feet = unit->name;
  feet.replace(feet.size() - 3, 2, "ee");
  char factor[32];
  std::snprintf(factor, sizeof factor, "%.10g", metres);
  return "Heights are taken as metres, for nothing states their unit; the CRS counts in " + feet +
         ": if the heights do, z_scale=" + factor;
}

/// The band's unit counts. The other one is mostly right where a copy has changed one of them.
std::string note_on_units(const Dataset& dataset, const Crs& crs, const HeightUnit& unit) {
  if (dataset.band->GetUnitType()[0] == '\0' || !(crs.height_unit_m > 0) || std::abs(unit.metres / crs.height_unit_m - 1) < 1e-9)
    return "";
  char factor[32];
  std::snprintf(factor, sizeof factor, "%.10g", crs.height_unit_m / unit.metres);
  return "The band says that its heights are in " + proto::shown_text(unit.name) + ", and the vertical CRS that they are in " +
         proto::shown_text(crs.height_unit) + ": the band's unit is taken; if the CRS is right, z_scale=" + factor;
}

proto::Result<HeightRule> height_rule(const Dataset& dataset, const Crs& crs, const HeightUnit& unit,
                                      const SourceOptions& options) {
  const double scale = dataset.band->GetScale() * unit.metres * (crs.depth ? -1 : 1);
  const double offset = dataset.band->GetOffset() * unit.metres * (crs.depth ? -1 : 1);
  HeightRule rule;
  rule.scale = scale * options.z_scale;
  rule.offset_m = offset * options.z_scale + options.z_offset_m;
  rule.voids = options.voids;
  rule.void_height_m = options.void_height_m;
  if (!std::isfinite(rule.scale) || rule.scale == 0 || !std::isfinite(rule.offset_m))
    return Problem{"raster-scale", dataset.name + " has a scale or offset that gives no heights",
                   "a band scale other than 0 and a finite offset", ""};
  return rule;
}

/// Where data can lie, in pixel coordinates, and on the earth.
proto::Result<Footprint> place_on_earth(SourceParts& parts, const Crs& crs) {
  const Dataset& d = parts.dataset;
  // A line of points has no area: then each stands for its pixel. So does each of few that are read in place of all, whose
  // centres end far inside the raster: between rasters that meet there would be a gap.
  parts.point = d.pixel_is_point && d.columns > 1 && d.rows > 1 && d.pixels == nullptr;
  const double rim = parts.point ? 0.5 : 0;
  const Footprint f = footprint(*parts.placement, {rim, rim, d.columns - rim, d.rows - rim});
  if (!(f.safe.north_deg > f.safe.south_deg))
    return Problem{"crs-not-transformable", "no part of " + d.name + " lies on the earth in its CRS, " + crs.label,
                   "a CRS that fits the coordinates", ""};
  parts.full_circle = f.full_circle;
  parts.area = f.safe;
  parts.pole_longitude_deg = f.full_circle ? 0 : (f.tight.west_deg + f.tight.east_deg) / 2;
  return f;
}

Problem outside(const SourceParts& parts, const Area& data) {
  return {"bbox-outside-raster", "the bbox does not touch " + parts.dataset.name + hint_on_order(*parts.options.bbox, data),
          "a bbox over the data, which lie in " + text_of(data), "bbox"};
}

/// West and east in each other's place: the box runs around the earth, over the antimeridian, and holds two sides of the data
/// without the middle; or a rim on one side, where the other end is beyond the data. Where the data reach the antimeridian, or
/// nearly do, such a box is meant.
std::optional<Problem> leaves_out_the_middle(const SourceParts& parts, const Footprint& f) {
  constexpr double kNearlyAround_deg = 10;  // what a raster of the whole earth may leave open
  constexpr double kMostOfTheEarth_deg = 270;
  const Area &box = *parts.options.bbox, &data = f.tight;
  const double west_deg = box.west_deg, east_deg = box.east_deg - 360;
  if (!(box.east_deg > 180 && east_deg < west_deg)) return std::nullopt;
  if (f.full_circle || data.east_deg > 180 || data.west_deg + 360 - data.east_deg <= kNearlyAround_deg) return std::nullopt;
  const double left_out_deg = std::min(west_deg, data.east_deg) - std::max(east_deg, data.west_deg);
  const bool both_sides = data.west_deg <= east_deg && west_deg <= data.east_deg;
  const bool one_rim = box.east_deg - west_deg > kMostOfTheEarth_deg && left_out_deg > (data.east_deg - data.west_deg) / 2;
  if (!both_sides && !one_rim) return std::nullopt;
  return Problem{"option-invalid",
                 "the bbox crosses the antimeridian, as its west is above its east: it would leave out the middle of " +
                     parts.dataset.name + ", which does not reach there",
                 "west below east, as in " + text_of({east_deg, box.south_deg, west_deg, box.north_deg}), "bbox"};
}

proto::Result<void> clip_to_bbox(SourceParts& parts, Footprint& f) {
  if (!parts.options.bbox) return {};
  const auto safe = intersect(f.safe, *parts.options.bbox), tight = intersect(f.tight, *parts.options.bbox);
  if (!safe || !tight) return outside(parts, f.safe);
  if (auto refused = leaves_out_the_middle(parts, f)) return *refused;
  // A full circle clipped on both sides of the antimeridian is the bbox itself.
  parts.area =
      f.full_circle ? Area{parts.options.bbox->west_deg, safe->south_deg, parts.options.bbox->east_deg, safe->north_deg} : *safe;
  f.tight = f.full_circle ? Area{parts.area.west_deg, tight->south_deg, parts.area.east_deg, tight->north_deg} : *tight;
  parts.full_circle = f.full_circle && parts.area.east_deg - parts.area.west_deg >= 360;
  return {};
}

/// In the middle; where that is a pole, half-way to a corner.
GroundSize pixel_size(const SourceParts& parts) {
  GroundSize size{};
  for (const double share : {0.5, 0.25, 0.75}) {
    size = ground_size(*parts.placement, share * (parts.dataset.columns - 1), share * (parts.dataset.rows - 1));
    if (size.width_m > kSmallestPixel_m && size.height_m > kSmallestPixel_m) break;
  }
  return size;
}

/// In WKT its words are joined by underscores.
std::string horizontal_datum(const Crs& crs) {
  const char* const name = crs.horizontal.GetAttrValue("DATUM");
  std::string words = name ? name : "";
  std::replace(words.begin(), words.end(), '_', ' ');
  return proto::shown_text(words);
}

/// No place on the earth is theirs, and GDAL's programs leave them out, too, without a word.
void note_beyond_the_earth(const SourceParts& parts, proto::Source& s) {
  const Dataset& d = parts.dataset;
  if (d.pixels != nullptr) return;  // so few are read in place of all
  const auto note = [&](std::int64_t count, const std::string& where) {
    if (count > 0)
      s.add_notes(std::to_string(count) + " of " + std::to_string(std::int64_t{d.columns} * d.rows) + " pixels of " +
                  proto::as_utf8(d.name) + " lie " + where + ", and are left out: is it placed right?");
  };
  note(parts.placement->pixels_beyond_poles(), "beyond a pole");
  note(parts.placement->pixels_beyond_turn(), "in columns beyond 360 degrees, where others are");
}

/// What a user should know of how the raster is read.
void add_notes(const SourceParts& parts, const Crs& crs, const HeightUnit& unit, bool z_scale_given, proto::Source& s) {
  const Dataset& d = parts.dataset;
  if (const std::string& beyond = parts.placement->beyond_area_of_use(); !beyond.empty()) s.add_notes(proto::as_utf8(beyond));
  note_beyond_the_earth(parts, s);
  if (std::string feet = z_scale_given ? "" : note_on_feet(d, crs); !feet.empty()) s.add_notes(std::move(feet));
  if (std::string units = z_scale_given ? "" : note_on_units(d, crs, unit); !units.empty()) s.add_notes(std::move(units));
  const bool bytes = d.band->GetRasterDataType() == GDT_Byte && !d.signed_byte;
  if (d.colour.empty() && bytes && !z_scale_given && s.scale() == 1)
    s.add_notes("the pixels of " + proto::as_utf8(d.name) +
                " are bytes, 0 to 255, and are taken for metres: a hillshade has such pixels, too");
  if (d.colour.empty()) return;
  s.add_notes(proto::as_utf8(d.name) + " is a picture, and its band " + std::to_string(d.band->GetBand()) + ", " + d.colour +
              ", is taken for heights");
}

void describe(SourceParts& parts, const Crs& crs, const HeightUnit& unit, const Footprint& f, const GroundSize& size) {
  proto::Source& s = parts.description;
  const Dataset& d = parts.dataset;
  s.set_file(proto::as_utf8(d.name));
  s.set_driver(d.driver);
  s.set_columns(static_cast<std::uint32_t>(d.columns));
  s.set_rows(static_cast<std::uint32_t>(d.rows));
  s.set_data_type(d.signed_byte ? "Int8" : GDALGetDataTypeName(d.band->GetRasterDataType()));
  s.set_crs(crs.label);
  s.set_crs_from(crs.from);
  s.set_vertical_datum(proto::shown_text(parts.datum.name));
  s.set_vertical_datum_from(parts.datum.from);
  s.set_vertical_grid(proto::shown_text(parts.datum.grid));
  s.set_vertical_datum_declared(proto::shown_text(crs.declared_datum));
  s.set_horizontal_datum(horizontal_datum(crs));
  s.set_datum_ignored(parts.placement->ignores_datum());
  s.set_unit(proto::shown_text(unit.name));
  s.set_scale(parts.height_rule.scale);
  s.set_offset(parts.height_rule.offset_m);
  s.set_nodata(Validity(d).text());
  s.set_pixel(d.pixel_is_point ? "point" : "area");
  s.set_pixel_width_m(size.width_m);
  s.set_pixel_height_m(size.height_m);
  // West in [-180, 180), east in (-180, 180]: west > east says that the data crosses the antimeridian.
  const double west = f.tight.west_deg - 360 * std::floor((f.tight.west_deg + 180) / 360);
  const double east = f.tight.east_deg - 360 * std::ceil((f.tight.east_deg - 180) / 360);
  s.add_bbox(parts.full_circle ? -180 : west);
  s.add_bbox(f.tight.south_deg);
  s.add_bbox(parts.full_circle ? 180 : east);
  s.add_bbox(f.tight.north_deg);
}

bool all_blocks_missing(const Dataset& d) {
  return d.is_sparse() && (d.covered == nullptr || d.covered->is_empty()) &&
         std::all_of(d.missing.begin(), d.missing.end(), [](bool missing) { return missing; });
}

/// pixels: in place of the raster's own; null: those.
proto::Result<std::unique_ptr<Source>> open_checked(const std::string& path, const std::string& name, Trust trust,
                                                    const proto::BuildOptions& options,
                                                    const std::shared_ptr<const Decimation>& pixels) {
  auto checked = check_options(options);
  if (!checked) return checked.problem();
  const auto has_crs = [&options](const Dataset& points) -> proto::Result<void> {
    const auto found = resolve_crs(points, options.crs());
    return found.ok() ? proto::Result<void>() : found.problem();
  };
  auto dataset = open_dataset(path, name, trust, options.band(), has_crs);
  if (!dataset) return dataset.problem();
  const GdalScope scope(trust);
  SourceParts parts;
  parts.options = *checked;
  parts.dataset = std::move(*dataset);
  parts.dataset.asked_nodata = checked->nodata;
  // A raster that lies nowhere is told so first: a CRS would not help it.
  if (auto placed = check_placed(parts.dataset); !placed.ok()) return placed.problem();
  auto crs = resolve_crs(parts.dataset, options.crs());
  if (!crs) return crs.problem();
  // Not before: what a file says of its coordinates may stand where only its own driver finds it.
  if (pixels != nullptr) {
    if (auto thinned = put_decimation(parts.dataset, pixels); !thinned.ok()) return thinned.problem();
  }
  const auto system = system_named(options.vertical_datum(), trust);
  const double system_z_scale = system ? take_axis_of(*system, parts.dataset, *crs) * parts.options.z_scale : 1;
  auto unit = unit_of(parts.dataset, *crs, options.has_z_scale());
  if (!unit) return unit.problem();
  auto rule = height_rule(parts.dataset, *crs, *unit, parts.options);
  if (!rule) return rule.problem();
  parts.height_rule = *rule;
  auto placement = Placement::make(parts.dataset, *crs);
  if (!placement) return placement.problem();
  parts.placement = std::move(*placement);
  auto f = place_on_earth(parts, *crs);
  if (!f) return f.problem();
  if (auto clipped = clip_to_bbox(parts, *f); !clipped.ok()) return clipped.problem();
  const GroundSize size = pixel_size(parts);
  if (!(size.width_m > kSmallestPixel_m && size.height_m > kSmallestPixel_m))
    return Problem{"crs-mismatch",
                   "a pixel of " + parts.dataset.name + " in its CRS, " + crs->label + ", would be smaller than a millimetre",
                   "a raster whose CRS fits its coordinates", crs->from == "request" ? "crs" : ""};
  if (all_blocks_missing(parts.dataset) && parts.options.voids != VoidRule::value)
    return Problem{"raster-all-nodata",
                   parts.dataset.name + (parts.dataset.covered != nullptr ? " is a VRT of rasters that lie beside it"
                                                                          : " is a sparse file without a single stored block"),
                   "a raster with some data", ""};
  const VerticalAsked asked{options.vertical_datum(),
                            crs->declared_datum,
                            crs->geoid_grids,
                            crs->compound_wkt,
                            crs->horizontal_wkt,
                            system,
                            system_z_scale};
  auto datum = resolve_vertical(asked, trust, f->tight);
  if (!datum) return datum.problem();
  parts.datum = std::move(*datum);
  if (parts.datum.from == "source") parts.datum.from = crs->vertical_from;
  describe(parts, *crs, *unit, *f, size);
  add_notes(parts, *crs, *unit, options.has_z_scale(), parts.description);
  return std::unique_ptr<Source>(std::make_unique<RasterSource>(std::move(parts)));
}

}  // namespace

namespace {

proto::Result<std::unique_ptr<Source>> open_with(const std::string& path, const std::string& name, Trust trust,
                                                 const proto::BuildOptions& options,
                                                 const std::shared_ptr<const Decimation>& pixels) {
  const GdalScope scope(trust);
  auto opened = open_checked(path, name, trust, options, pixels);
  // Not the raster's fault, and what was opened all the same may lie elsewhere: a rougher transformation stands in for one not
  // found.
  if (scope.tables_failed())
    return Problem{
        "crs-tables-unreadable",
        "the tables of coordinate systems (PROJ's proj.db) cannot be read, which " + proto::shown_text(name) + " needs",
        "trying again later", ""};
  return opened;
}

}  // namespace

proto::Result<std::unique_ptr<Source>> open_source(const std::string& path, const std::string& name, Trust trust,
                                                   const proto::BuildOptions& options) {
  return open_with(path, name, trust, options, nullptr);
}

proto::Result<std::unique_ptr<Source>> open_filled_source(const std::string& path, const std::string& name, Trust trust,
                                                          const proto::BuildOptions& options) {
  auto opened = open_with(path, name, trust, options, nullptr);
  if (!opened.ok()) return opened;
  *opened = fill_enclosed_voids(std::move(*opened), fill_limit_cells(options));
  return opened;
}

proto::Result<std::unique_ptr<Source>> open_decimated(const std::string& path, const std::string& name, Trust trust,
                                                      const proto::BuildOptions& options,
                                                      const std::shared_ptr<const Decimation>& pixels) {
  return open_with(path, name, trust, options, pixels);
}

}  // namespace cordillera::raster
