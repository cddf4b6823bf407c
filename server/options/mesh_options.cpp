#include "server/options/mesh_options.h"

#include <algorithm>
#include <array>
#include <limits>

#include "pipeline/faces/face.h"
#include "proto/letters.h"

namespace cordillera::server {
namespace {

using pipeline::exports::MeshFrame;
using pipeline::exports::MeshRequest;

Complaint take_tile(std::string_view text, MeshRequest& request) {
  std::uint32_t numbers[3] = {0, 0, 0};
  std::string_view rest = text;
  for (int k = 0; k < 3; ++k) {
    const auto slash = k < 2 ? rest.find('/') : rest.size();
    if (slash == std::string_view::npos) return "not three numbers with slashes between";
    if (auto complaint = read_whole(rest.substr(0, slash), {0, 0x7fffffff}, &numbers[k])) return complaint;
    rest.remove_prefix(std::min(rest.size(), slash + 1));
  }
  const pipeline::faces::Place place{0, static_cast<int>(numbers[0]), static_cast<std::int32_t>(numbers[1]),
                                     static_cast<std::int32_t>(numbers[2])};
  if (!pipeline::faces::inside(pipeline::faces::Grid::geodetic, place)) return "the grid has no such tile";
  request.tile = {place.z, place.x, place.y};
  return std::nullopt;
}

Complaint take_level(std::string_view text, MeshRequest& request) {
  std::uint32_t level = 0;
  constexpr std::uint32_t kAny = std::numeric_limits<std::int32_t>::max();  // the dataset says which it has
  if (auto complaint = read_whole(text, {0, kAny}, &level)) return complaint;
  request.level = static_cast<int>(level);
  return std::nullopt;
}

Complaint take_mesh_box(std::string_view text, MeshRequest& request) {
  std::array<double, 4> box{};
  if (auto complaint = read_box(text, &box)) return complaint;
  request.box = raster::area_of(box);
  return std::nullopt;
}

constexpr std::string_view kAuthority = "EPSG:";

/// The digits of EPSG:32632, or of 32632 as crs takes it; else none. A code alone: PROJ reads files whose names a CRS may have.
std::string_view epsg_code(std::string_view text) {
  constexpr std::size_t kMostDigits = 6;
  if (proto::same_letters(text.substr(0, kAuthority.size()), kAuthority)) text.remove_prefix(kAuthority.size());
  return text.size() <= kMostDigits && text.find_first_not_of("0123456789") == text.npos ? text : std::string_view();
}

Complaint take_frame(std::string_view text, MeshRequest& request) {
  if (const std::string_view code = epsg_code(text); !code.empty()) {
    request.frame = MeshFrame::map;
    request.map = std::string(kAuthority).append(code);
    return std::nullopt;
  }
  std::string name;
  if (auto complaint = read_choice(text, {"enu", "ecef", "geodetic", "crs"}, &name)) return complaint;
  request.frame = name == "enu"    ? MeshFrame::enu
                  : name == "ecef" ? MeshFrame::ecef
                  : name == "crs"  ? MeshFrame::map
                                   : MeshFrame::geodetic;
  return std::nullopt;
}

}  // namespace

const std::vector<MeshOption>& mesh_options() {
  static const std::vector<MeshOption> kOptions = {
      {"tile", "Z/X/Y", "one tile, by its level, x and y from the south", "z/x/y, such as 10/617/763; not with level or bbox",
       take_tile},
      {"level", "LEVEL", "the level whose tiles are welded; without it the finest that stays within the limit of triangles",
       "a level of the dataset", take_level},
      {"bbox", "W,S,E,N", "only this box, degrees: triangles are cut at its sides; west above east crosses the antimeridian",
       "west,south,east,north in degrees, longitudes -180 to 180, latitudes -90 to 90", take_mesh_box},
      {"frame", "FRAME",
       "what coordinates are: metres east, north and up of the middle; earth-centred metres; degrees and metres; or those of the "
       "raster's own projected CRS, or of another one, with heights above the geoid",
       "enu, ecef (not stl), geodetic (ply and obj only), crs or a code such as EPSG:32632 (not stl)", take_frame},
  };
  return kOptions;
}

proto::Result<MeshRequest> mesh_request(const Given& given, Spelling spelling) {
  MeshRequest request;
  if (auto problem = read_options(mesh_options(), given, {.spelling = spelling}, request)) return *problem;
  if (request.tile && (request.level || request.box)) {
    const std::string tile = spelt("tile", spelling);
    return proto::Problem{"options-conflict", tile + " names a place of its own", "tile, or level and bbox", tile};
  }
  return request;
}

}  // namespace cordillera::server
