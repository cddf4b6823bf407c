// The entries of the option table. Help and accepted values are written once, here.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "gpu/simplify.h"
#include "pipeline/plan/plan.h"
#include "proto/lattice.h"
#include "proto/mesh.h"
#include "raster/sample/back_projection.h"
#include "raster/voids/filled_source.h"
#include "server/access/client_address.h"
#include "server/options/options.h"
#include "server/http/dataset_id.h"

namespace cordillera::server {
namespace {

constexpr double kGreatest = std::numeric_limits<double>::max();

Complaint apply_error(std::string_view text, Settings& settings) {
  double value = 0;
  if (auto complaint = read_number(text, {0.01, 1e6}, &value)) return complaint;
  settings.build.set_error(value);
  settings.build.clear_keep();
  return std::nullopt;
}

Complaint apply_keep(std::string_view text, Settings& settings) {
  std::vector<double> shares;
  if (auto complaint = read_numbers(text, {0, 1}, &shares)) return complaint;
  if (shares.size() > proto::kMaxLevel + 1) return "more shares than there can be levels";
  for (std::size_t i = 0; i < shares.size(); ++i) {
    if (shares[i] <= 0) return "share " + std::to_string(i + 1) + " is not above 0";
    if (i > 0 && shares[i] > shares[i - 1]) return "share " + std::to_string(i + 1) + " is greater than the one before";
  }
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
  double height_m = 0;
  if (auto complaint = read_number(text, {-kGreatest, proto::kMaxHeight_m}, &height_m)) return *complaint + ", and neither fill nor hole";
  if (height_m < raster::kLeastVoidHeight_m) {
    return "pits deeper than any land; nodata=" + std::string(text) + " says that this value means no data";
  }
  settings.build.set_voids(std::string(text));
  return std::nullopt;
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
  std::string nan;
  if (!read_choice(text, {"nan"}, &nan)) {
    settings.build.set_nodata(nan);
    return std::nullopt;
  }
  if (auto complaint = read_number(text, {-kGreatest, kGreatest}, &value)) return "neither a number nor nan";
  settings.build.set_nodata(shown(value));
  return std::nullopt;
}

Complaint apply_fill_limit(std::string_view text, Settings& settings) {
  std::uint32_t cells = 0;
  if (auto complaint = read_whole(text, {0, raster::kGreatestFillLimit_cells}, &cells)) return complaint;
  settings.build.set_fill_limit(cells);
  return std::nullopt;
}

Complaint apply_water(std::string_view text, Settings& settings) {
  double height_m = 0;
  if (auto complaint = read_number(text, {-proto::kMaxHeight_m, proto::kMaxHeight_m}, &height_m)) return complaint;
  settings.build.set_water(height_m);
  return std::nullopt;
}

Complaint apply_bbox(std::string_view text, Settings& settings) {
  std::vector<double> box;
  if (auto complaint = read_numbers(text, {-360, 360}, &box)) return complaint;
  if (box.size() != 4) return std::to_string(box.size()) + " numbers instead of 4";
  // What other programs take, named in the order that is wanted here: latitude first, or gdal_translate's upper left corner first.
  const auto in_order = [](double west, double south, double east, double north) {
    return "; in the order west,south,east,north it may be " + shown(west) + "," + shown(south) + "," + shown(east) + "," + shown(north);
  };
  if (std::abs(box[1]) > 90 || std::abs(box[3]) > 90) {
    const bool turned = std::abs(box[0]) <= 90 && std::abs(box[2]) <= 90 && box[0] < box[2];
    return "a latitude is beyond a pole" + (turned ? in_order(box[1], box[0], box[3], box[2]) : "");
  }
  if (box[1] > box[3]) {
    // Both corners may be turned. A box over the antimeridian is left as it is: it is the narrower of the two that the longitudes can mean.
    const bool turned = box[0] > box[2] && box[0] - box[2] < 180;
    return "south is not below north" + in_order(turned ? box[2] : box[0], box[3], turned ? box[0] : box[2], box[1]);
  }
  if (box[1] == box[3]) return "south equals north";
  if (std::abs(box[0]) > 180 || std::abs(box[2]) > 180) return "a longitude is outside -180 to 180";
  if (box[0] == box[2]) return "west equals east";
  settings.build.mutable_bbox()->Assign(box.begin(), box.end());
  return std::nullopt;
}

Complaint apply_memory(std::string_view text, Settings& settings) {
  std::uint32_t value = 0;
  if (auto complaint = read_whole(text, {0, 1u << 24}, &value)) return complaint;
  if (value != 0 && value < 64) return "less than 64";
  settings.build.set_memory(value);
  return std::nullopt;
}

Complaint apply_feather(std::string_view text, Settings& settings) {
  double value_m = 0;
  if (auto complaint = read_number(text, {0, 1e5}, &value_m)) return complaint;
  settings.build.set_feather(value_m);
  return std::nullopt;
}

Complaint apply_z_scale(std::string_view text, Settings& settings) {
  double value = 0;
  if (auto complaint = read_number(text, {-1e6, 1e6}, &value)) return complaint;
  if (value == 0) return "0 would flatten everything";
  settings.build.set_z_scale(value);
  return std::nullopt;
}

Complaint apply_z_offset(std::string_view text, Settings& settings) {
  double value = 0;
  if (auto complaint = read_number(text, {-1e6, 1e6}, &value)) return complaint;
  settings.build.set_z_offset(value);
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

Complaint apply_listen(std::string_view text, Settings& settings) {
  const auto colon = text.rfind(':');
  std::uint32_t port = 0;
  if (colon == std::string_view::npos || colon == 0) return "no host before a port";
  if (auto complaint = read_whole(text.substr(colon + 1), {0, 65535}, &port)) return "port " + *complaint;
  settings.serve.listen = std::string(text);
  return std::nullopt;
}

template <std::string ServeSettings::*field>
Complaint apply_path(std::string_view text, Settings& settings) {
  if (text.empty()) return "empty";
  settings.serve.*field = std::string(text);
  return std::nullopt;
}

Complaint apply_proxies(std::string_view text, Settings& settings) {
  std::vector<std::string> addresses;
  for (std::string_view rest = text; !rest.empty();) {
    const std::string_view one = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), one.size() + 1));
    auto address = access::plain_address(one);
    if (!address) return std::string(one) + " is no address";
    addresses.push_back(std::move(*address));
  }
  settings.serve.trusted_proxies = std::move(addresses);
  return std::nullopt;
}

/// NAME=PATH, separated by commas.
Complaint apply_mounts(std::string_view text, Settings& settings) {
  std::vector<Mount> mounts;
  for (std::string_view rest = text; !rest.empty();) {
    const std::string_view one = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), one.size() + 1));
    const std::size_t sign = one.find('=');
    if (sign == one.npos || sign + 1 == one.size()) return std::string(one) + " is no NAME=PATH";
    const Mount mount{std::string(one.substr(0, sign)), std::string(one.substr(sign + 1))};
    if (!is_id(mount.name)) return "'" + mount.name + "' cannot stand in an address";
    for (const Mount& other : mounts) {
      if (other.name == mount.name) return mount.name + " is named twice";
    }
    mounts.push_back(mount);
  }
  settings.serve.mounts = std::move(mounts);
  return std::nullopt;
}

/// Beginnings of addresses, separated by commas. One that ends within a host's name would let others in.
Complaint apply_source_allow(std::string_view text, Settings& settings) {
  std::vector<std::string> prefixes;
  for (std::string_view rest = text; !rest.empty();) {
    const std::string one(rest.substr(0, rest.find(',')));
    rest.remove_prefix(std::min(rest.size(), one.size() + 1));
    const std::size_t slashes = one.find("://");
    if (slashes == std::string::npos) return one + " names no scheme such as https://";
    if (one.find('/', slashes + 3) == std::string::npos) return one + " has no / behind its host or bucket";
    prefixes.push_back(one);
  }
  settings.serve.source_allow = std::move(prefixes);
  return std::nullopt;
}

template <std::uint32_t Limits::*field, std::uint32_t least, std::uint32_t greatest>
Complaint apply_limit(std::string_view text, Settings& settings) {
  return read_whole(text, {least, greatest}, &(settings.serve.limits.*field));
}

/// What each of several rasters may have of its own.
constexpr std::string_view kOfRaster[] = {"name", "band", "crs", "vertical-datum", "nodata", "voids", "z-scale", "z-offset"};

std::vector<OptionSpec> with_marks(std::vector<OptionSpec> options) {
  for (OptionSpec& option : options) {
    option.of_raster = std::find(std::begin(kOfRaster), std::end(kOfRaster), option.name) != std::end(kOfRaster);
    if (option.name == "nodata") option.alias = "source-nodata";
  }
  return options;
}

std::vector<OptionSpec> make_build_options() {
  constexpr std::uint32_t kLevel = proto::kMaxLevel;
  const std::string level = "a level from 0 to " + std::to_string(kLevel);
  return with_marks({
      {"name", "NAME", "what the raster is called; an .hgt knows its place only by this", "text, such as N44W072.hgt",
       apply_text<&BuildOptions::mutable_name>},
      {"band", "BAND", "which band of the file holds the heights, or which of several rasters in it (NetCDF, GeoPackage)",
       "a number from 1 on, or a name: a band's, a variable's or a table's", apply_band},
      {"error", "METRES", "greatest deviation allowed at the finest level; doubles a level upwards",
       "metres, 0.01 to 1000000", apply_error},
      {"keep", "SHARES", "shares of the finest grid's triangles, finest level first; the last ratio is repeated",
       "numbers above 0 up to 1, falling, separated by commas: 0.5,0.25,0.1", apply_keep},
      {"scheme", "SCHEME", "how tiles divide the earth", "geodetic",
       [](std::string_view text, Settings& settings) {
         return read_choice(text, {"geodetic"}, settings.build.mutable_scheme());
       }},
      {"crs", "CRS", "coordinate system of a raster that names none", "anything PROJ understands, such as EPSG:32632 or WKT",
       apply_text<&BuildOptions::mutable_crs>},
      {"vertical-datum", "DATUM", "what the raster's heights are above, if it does not say so itself",
       "EGM96, EGM2008, EGM84, ellipsoid, a height system by name or code such as NAVD88 or EPSG:5703, or a geoid grid file (over HTTP: "
       "the bare name of one in the operator's geoid folders)",
       apply_datum},
      {"nodata", "VALUE",
       "a value of the raster that means no data, beside the one that the file declares; before scale and offset",
       "a number as it stands in the file, such as -9999, or nan", apply_nodata},
      {"voids", "WHAT", "what becomes of places without data: fill closes those that data encloses with a smooth surface",
       "fill, hole, or a height in metres, -500 to 16384, that is put there (of one raster among several: a height)", apply_voids},
      {"fill-limit", "CELLS", "voids that are wider or higher than this, in cells of the finest level, are not filled", "0 to 1024",
       apply_fill_limit},
      {"water", "HEIGHT", "pixels of exactly this height, in metres above the vertical datum, are water: quantized-mesh then has water masks",
       "a height in metres, -16384 to 16384", apply_water},
      {"water-mask", "FILE", "a raster in any CRS that is not zero where water is, in place of water; on the command line only",
       "a single-band raster that GDAL can read", apply_text<&BuildOptions::mutable_water_mask>},
      {"strategy", "NAME", "how meshes are simplified; exact: large blocks, no sample ever farther off than the error; auto: exact where it can be, else waves; cleap and sequential: the published "
       "algorithm, to be compared with",
       "auto, waves, exact, cleap or sequential",
       [](std::string_view text, Settings& settings) {
         std::vector<std::string> names{pipeline::kAutoStrategy};
         names.insert(names.end(), gpu::kStrategies.begin(), gpu::kStrategies.end());
         return read_choice(text, names, settings.build.mutable_strategy());
       }},
      {"quality", "QUALITY", "with error: fast leaves out what makes the triangles fewer, best takes more time for it",
       "fast, default or best",
       [](std::string_view text, Settings& settings) {
         return read_choice(text, {"fast", "default", "best"}, settings.build.mutable_quality());
       }},
      {"pixels", "PIXELS", "exact: the finest level keeps its error at the raster's own pixels, too; lattice: at the samples of the level alone, with fewer triangles, as do levels of cells wider than a pixel and keep=",
       "exact or lattice",
       [](std::string_view text, Settings& settings) {
         return read_choice(text, {raster::kExactPixels, raster::kLatticePixels}, settings.build.mutable_pixels());
       }},
      {"device", "DEVICE", "what computes", "auto, cpu, cuda or cuda:N",
       [](std::string_view text, Settings& settings) { return read_device(text, settings.build.mutable_device()); }},
      {"threads", "N", "threads of a build; 0: as many as the machine has", "0 to 1024",
       apply_whole<&BuildOptions::set_threads, 1024>},
      {"memory", "MIB", "memory a build may use on top of the program, MiB; takes a thread for each 96 MiB at most; 0: the default",
       "0, or 64 to 16777216", apply_memory},
      {"bbox", "W,S,E,N", "build only this box, degrees; west above east crosses the antimeridian",
       "west,south,east,north in degrees, longitudes -180 to 180, latitudes -90 to 90", apply_bbox},
      {"min-level", "LEVEL", "coarsest level to publish", level, apply_whole<&BuildOptions::set_min_level, kLevel>},
      {"max-level", "LEVEL", "finest level; default: the first that is as fine as the raster", level,
       apply_whole<&BuildOptions::set_max_level, kLevel>},
      {"z-scale", "FACTOR", "height = z-scale * value + z-offset, after the source's own scale and unit", "a number, not 0",
       apply_z_scale},
      {"feather", "METRES", "width over which one of several rasters gives way to the next, at its rims and voids", "0 to 100000",
       apply_feather},
      {"z-offset", "METRES", "see z-scale", "metres", apply_z_offset},
      {"title", "TEXT", "title carried into manifest, tileset, status and every .glb", "text", apply_text<&BuildOptions::mutable_title>},
      {"attribution", "TEXT", "attribution carried into manifest, tileset, status and every .glb", "text",
       apply_text<&BuildOptions::mutable_attribution>},
      {"imagery", "ADDRESS", "tiles of pictures that viewer and client pages lay on the terrain; named in manifest, tileset and status", kImagery,
       [](std::string_view text, Settings& settings) { return read_imagery(text, settings.build.mutable_imagery()); }},
      {"dry-run", "", "say levels, tiles, bytes and time expected; build nothing", "1 or 0",
       [](std::string_view text, Settings& settings) { return read_switch(text, &settings.dry_run); }},
  });
}

std::vector<OptionSpec> make_serve_options() {
  return {
      {"listen", "HOST:PORT", "where to listen; port 0: any free one", "an address and a port, such as 127.0.0.1:8080",
       apply_listen},
      {"data", "DIR", "folder that holds everything the service keeps", "a folder that can be written",
       apply_path<&ServeSettings::data>},
      {"web", "DIR", "folder of the viewer page; default: the one built with the program", "a folder",
       apply_path<&ServeSettings::web>},
      {"geoids", "DIRS", "folders of geoid grids that requests may name as vertical_datum", "folders, separated by colons",
       apply_path<&ServeSettings::geoids>},
      {"jobs", "N", "builds that run at the same time", "1 to 64",
       [](std::string_view text, Settings& settings) {
         return read_whole(text, {1, 64}, &settings.serve.jobs);
       }},
      {"log-level", "LEVEL", "what is logged to stderr", "debug, info, warn or error",
       [](std::string_view text, Settings& settings) {
         return read_choice(text, {"debug", "info", "warn", "error"}, &settings.serve.log_level);
       }},
      {"log-format", "FORMAT", "how it is logged: for people, or a JSON object a line", "text or json",
       [](std::string_view text, Settings& settings) { return read_choice(text, {"text", "json"}, &settings.serve.log_format); }},
      {"tokens", "FILE", "who may write: lines of `cordillera token new`; looked at again when it has changed", "a file",
       apply_path<&ServeSettings::tokens>},
      {"token-lines", "LINES", "such lines themselves, for containers that have no file", "lines, separated by semicolons",
       apply_path<&ServeSettings::token_lines>},
      {"insecure-writes", "", "without tokens, let everybody who reaches the port write", "1 or 0",
       [](std::string_view text, Settings& settings) { return read_switch(text, &settings.serve.insecure_writes); }},
      {"trusted-proxies", "ADDRESSES", "proxies whose X-Forwarded-For is believed", "addresses, separated by commas", apply_proxies},
      {"mount", "NAME=PATH,…", "datasets that were published elsewhere, to be served from there: a .sqlite file, or a folder that build wrote",
       "names of small letters, digits and dashes, each with a path: dem=/srv/dem.sqlite,europe=/vsis3/bucket/europe.sqlite", apply_mounts},
      {"live", "FOLDER", "every raster in this folder and below it is a dataset: found, changed and gone while the service runs", "a folder",
       apply_path<&ServeSettings::live>},
      {"cache-size", "MIB", "memory for what was read of mounted datasets, MiB", "1 to 1048576",
       [](std::string_view text, Settings& settings) { return read_whole(text, {1, 1u << 20}, &settings.serve.cache_mib); }},
      {"keep-versions", "N", "earlier versions that are kept of a dataset whose rasters change", "0 to 100",
       [](std::string_view text, Settings& settings) { return read_whole(text, {0, 100}, &settings.serve.keep_versions); }},
      {"source-allow", "PREFIXES", "addresses that the service may fetch rasters from (source=); without it none",
       "beginnings of http://, https:// or s3:// addresses with a / behind the host, separated by commas", apply_source_allow},
      {"live-fresh", "SECONDS", "how long a raster that /v1/live has fetched counts as the same before its address is asked again", "0 to 86400",
       [](std::string_view text, Settings& settings) { return read_whole(text, {0, 86400}, &settings.serve.live_fresh_seconds); }},
      {"live-open", "", "let everybody who may read have rasters fetched by /v1/live, not only who may post", "1 or 0",
       [](std::string_view text, Settings& settings) { return read_switch(text, &settings.serve.live_open); }},
      {"audit-log", "FILE", "where a line is written for every request that writes; default: audit.jsonl in the data folder", "a file",
       apply_path<&ServeSettings::audit_log>},
  };
}

std::vector<OptionSpec> make_limits() {
  return {
      {"body-limit", "MIB", "greatest raster that may be posted, MiB", "1 to 16777216", apply_limit<&Limits::body_mib, 1, 1u << 24>, &Limits::body_mib, "MiB"},
      {"max-megapixels", "N", "most pixels of a posted raster, millions", "1 to 68719", apply_limit<&Limits::megapixels, 1, 68719>, &Limits::megapixels,
       "million pixels"},
      {"max-side", "PIXELS", "longest side of a posted raster, pixels", "1 to 2147483647", apply_limit<&Limits::side, 1, 2147483647>, &Limits::side, "pixels"},
      {"max-datasets", "N", "datasets that are kept at the same time", "1 to 10000000", apply_limit<&Limits::datasets, 1, 10000000>, &Limits::datasets,
       "datasets"},
      {"max-queue", "N", "builds that wait for their turn; further posts are told to come again", "1 to 100000", apply_limit<&Limits::queue, 1, 100000>,
       &Limits::queue, "builds"},
      {"max-uploads", "N", "uploads at the same time", "1 to 1000", apply_limit<&Limits::uploads, 1, 1000>, &Limits::uploads, "uploads"},
      {"max-client-uploads", "N", "uploads of one token, or of one address without tokens, at the same time", "1 to 1000",
       apply_limit<&Limits::client_uploads, 1, 1000>, &Limits::client_uploads, "uploads"},
      {"max-build-time", "SECONDS", "how long one build may take, whatever its raster", "1 to 31536000", apply_limit<&Limits::build_seconds, 1, 31536000>,
       &Limits::build_seconds, "seconds"},
      {"build-time-base", "SECONDS", "how long the build of a small raster may take; larger ones may take longer", "1 to 31536000",
       apply_limit<&Limits::build_base_seconds, 1, 31536000>, &Limits::build_base_seconds, "seconds"},
      {"build-time-per-mib", "SECONDS", "how much longer a build may take for each MiB of its rasters", "0 to 31536000",
       apply_limit<&Limits::build_seconds_per_mib, 0, 31536000>, &Limits::build_seconds_per_mib, "seconds per MiB"},
      {"max-connections", "N", "connections at the same time; beyond them the longest idle one makes room", "16 to 100000",
       apply_limit<&Limits::connections, 16, 100000>, &Limits::connections, "connections"},
      {"max-client-connections", "N", "connections of one address at the same time", "1 to 100000", apply_limit<&Limits::client_connections, 1, 100000>,
       &Limits::client_connections, "connections"},
      {"max-client-streams", "N", "event streams and waiting requests of one address at the same time", "1 to 512",
       apply_limit<&Limits::client_streams, 1, 512>, &Limits::client_streams, "clients"},
      {"max-wait", "SECONDS", "how long a request may wait for a tile that is still to be made; 0: no request waits", "0 to 600",
       apply_limit<&Limits::wait_seconds, 0, 600>, &Limits::wait_seconds, "seconds"},
      {"max-unsent", "MIB", "memory of large answers that clients have yet to read, MiB; what several share counts once", "1 to 1048576",
       apply_limit<&Limits::unsent_mib, 1, 1u << 20>, &Limits::unsent_mib, "MiB"},
      {"max-client-unsent", "MIB", "the same of one address", "1 to 1048576", apply_limit<&Limits::client_unsent_mib, 1, 1u << 20>,
       &Limits::client_unsent_mib, "MiB"},
      {"min-rate", "BYTES", "bytes a second that a client must send or read on average, once it has kept the server waiting for 10 s", "1 to 1000000000",
       apply_limit<&Limits::min_rate, 1, 1000000000>, &Limits::min_rate, "bytes per second"},
      {"answer-timeout", "SECONDS", "how long a client may keep the server waiting while it reads an answer: a large one has to be read faster than min-rate",
       "11 to 86400", apply_limit<&Limits::answer_seconds, 11, 86400>, &Limits::answer_seconds, "seconds"},
      {"head-timeout", "SECONDS", "how long the head of a request may take", "1 to 3600", apply_limit<&Limits::head_seconds, 1, 3600>,
       &Limits::head_seconds, "seconds"},
      {"idle-timeout", "SECONDS", "how long a connection may stay without a request", "1 to 86400", apply_limit<&Limits::idle_seconds, 1, 86400>,
       &Limits::idle_seconds, "seconds"},
      {"cache-limit", "MIB", "disk for what was fetched by /v1/live and for blocks that lazy datasets have made, MiB; what was read longest ago goes first; 0: no limit",
       "0 to 1073741824", apply_limit<&Limits::cache_mib, 0, 1u << 30>, &Limits::cache_mib, "MiB"},
      {"min-disk-free", "PERCENT", "share of the disk that posts and builds leave free", "0 to 100", apply_limit<&Limits::free_percent, 0, 100>,
       &Limits::free_percent, "percent"},
  };
}

std::vector<OptionSpec> make_posting_options() {
  return {{"private", "", "let only those read the dataset who have a token", "1 or 0",
           [](std::string_view text, Settings& settings) { return read_switch(text, &settings.private_dataset); }},
          {"provisional", "SWITCH", "show coarse tiles of a raster soon after it was posted, until its build is done", "on or off",
           [](std::string_view text, Settings& settings) {
             bool shown = true;
             auto complaint = read_switch(text, &shown);
             if (!complaint) settings.build.set_provisional(shown);
             return complaint;
           }},
          {"build", "BLOCKS", "make all blocks of a raster at once, or each when one of its tiles is asked for", "full or lazy", [](std::string_view text, Settings& settings) {
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

const std::vector<OptionSpec>& posting_options() {
  static const std::vector<OptionSpec> table = make_posting_options();
  return table;
}

const std::vector<OptionSpec>& serve_options() {
  static const std::vector<OptionSpec> table = [] {
    std::vector<OptionSpec> all = make_serve_options();
    for (OptionSpec& limit : make_limits()) all.push_back(std::move(limit));
    return all;
  }();
  return table;
}

}  // namespace cordillera::server
