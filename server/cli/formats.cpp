// Faces, and what their tiles look like, as a command line has them.
#include <algorithm>
#include <cstdint>
#include <sstream>

#include "pipeline/contours/interval.h"
#include "pipeline/faces/tiles_3d/glb_tile.h"
#include "raster/photo/orthophoto.h"
#include "server/cli/commands.h"
#include "server/options/option_values.h"

namespace cordillera::server {
namespace {

// What clients of the first minute need. Everything else can be asked for, and is served on request in any case.
constexpr const char* kUsual = "drc,3d-tiles";

/// What faces with .glb tiles are called, and begin with.
constexpr const char* k3dTiles = "3d-tiles";
constexpr const char *kOf3dTiles = "3D Tiles", *k3dArchives = ".3tz";

/// Pixels of a texture from side to side: a tile's own cells, or each of them cut in 2, 4 or 8.
constexpr std::string_view kTextureSizes[] = {"256", "512", "1024", "2048"};

constexpr LookOption kLookOptions[] = {
    {"--normals", "NAME",
     "light of 3D Tiles: normals of vertices, a normal map, or nothing [vertex, texture, none; default vertex]",
     &LookWords::normals, kOf3dTiles, k3dTiles, k3dArchives},
    {"--texture", "PHOTO", "an orthophoto, in any CRS, that is put on 3D Tiles as WebP [bands red, green and blue; alpha too]",
     &LookWords::texture, kOf3dTiles, k3dTiles, k3dArchives},
    {"--texture-size", "N", "pixels of it a tile's side [256, 512, 1024, 2048; default 256: one a cell of the terrain]",
     &LookWords::size, kOf3dTiles, k3dTiles, k3dArchives},
    {"--texture-quality", "N", "what WebP may lose of it [1 to 99; 100, the default: nothing]", &LookWords::quality, kOf3dTiles,
     k3dTiles, k3dArchives},
    {"--interval", "METRES",
     "from contour to contour; coarse zooms take a multiple [1 to 5000, up to three decimals; default: by zoom]",
     &LookWords::interval, "contours", "contours", ".pmtiles or .mbtiles, with --format contours"},
};

proto::Problem wrong_look(const std::string& option, const std::string& what, const std::string& accepted) {
  return {"usage", option + ": " + what, accepted, option};
}

/// How the orthophoto is to be put on.
proto::Result<void> read_texture(const LookWords& words, pipeline::faces::Look& look) {
  if (!words.size.empty()) {
    const auto* const size = std::find(std::begin(kTextureSizes), std::end(kTextureSizes), words.size);
    if (size == std::end(kTextureSizes))
      return wrong_look("--texture-size", "'" + words.size + "' is no size of a tile's texture", "256, 512, 1024 or 2048");
    look.photo_finer = static_cast<int>(size - std::begin(kTextureSizes));
  }
  if (words.quality.empty()) return {};
  std::uint32_t quality = 0;
  if (read_whole(words.quality, {1, pipeline::faces::kLossless}, &quality))
    return wrong_look("--texture-quality", "'" + words.quality + "' is no quality", "a whole number from 1 to 100");
  look.photo_quality = static_cast<int>(quality);
  return {};
}

}  // namespace

std::string face_names() {
  std::string names;
  for (const pipeline::faces::Face* face : pipeline::faces::all_faces())
    names.append(names.empty() ? "" : ", ").append(face->name);
  return names;
}

proto::Result<std::vector<const pipeline::faces::Face*>> formats_of(const std::string& names) {
  std::vector<const pipeline::faces::Face*> chosen;
  std::istringstream words(names.empty() ? kUsual : names);
  for (std::string word; std::getline(words >> std::ws, word, ',');) {
    word.erase(word.find_last_not_of(' ') + 1);
    const pipeline::faces::Face* face = pipeline::faces::face_named(word);
    if (face == nullptr)
      return proto::Problem{"usage", "--formats: there is no format '" + word + "'", face_names(), "--formats"};
    if (std::find(chosen.begin(), chosen.end(), face) == chosen.end()) chosen.push_back(face);
  }
  return chosen;
}

proto::Result<void> check_look(const LookWords& look, const std::vector<const pipeline::faces::Face*>& formats) {
  const LookOption* const other = look_of_others(look, formats);
  if (other == nullptr) return {};
  return proto::Problem{"usage", std::string(other->name) + " is for " + other->what + ", which --formats leaves out",
                        "--formats " + std::string(other->faces) + ", or no " + other->name, other->name};
}

const LookOption* look_of_others(const LookWords& look, std::span<const pipeline::faces::Face* const> faces) {
  for (const LookOption& option : kLookOptions) {
    const auto fits = [&](const pipeline::faces::Face* face) { return face->name.starts_with(option.faces); };
    if (!(look.*option.value).empty() && std::none_of(faces.begin(), faces.end(), fits)) return &option;
  }
  return nullptr;
}

proto::Result<void> check_look_of_store(const LookWords& look) {
  const LookOption* const given = look_of_others(look, {});
  if (given == nullptr) return {};
  return proto::Problem{"usage", std::string(given->name) + " is for a folder or an archive: a file of a dataset gives any",
                        "-o FOLDER", given->name};
}

std::span<const LookOption> look_options() { return kLookOptions; }

proto::Result<pipeline::faces::Look> look_of(const LookWords& words) {
  pipeline::faces::Look look;
  const auto normals = pipeline::faces::normals_named(words.normals);
  if (!normals) return wrong_look("--normals", "tiles cannot have '" + words.normals + "'", normals.problem().accepted);
  look.normals = *normals;
  if (!words.interval.empty()) {
    const auto interval = pipeline::contours::interval_asked(words.interval);
    if (!interval)
      return wrong_look("--interval", "'" + words.interval + "' is no interval of contours", interval.problem().accepted);
    look.interval_mm = interval->mm;
  }
  if (words.texture.empty()) {
    for (const LookOption& option : kLookOptions)
      if ((option.value == &LookWords::size || option.value == &LookWords::quality) && !(words.*option.value).empty())
        return wrong_look(option.name, "it is of an orthophoto, and none is named", "--texture PHOTO, too");
    return look;
  }
  if (const auto read = read_texture(words, look); !read) return read.problem();
  auto photo = raster::open_orthophoto(words.texture);
  if (!photo) {
    proto::Problem problem = photo.problem();
    problem.detail = "--texture: " + problem.detail;
    problem.parameter = "--texture";
    return problem;
  }
  look.photo = std::move(*photo);
  return look;
}

}  // namespace cordillera::server
