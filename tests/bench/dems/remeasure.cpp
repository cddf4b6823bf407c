// remeasure RASTER FOLDER [SAMPLES] [THREADS]: what a folder that `cordillera build RASTER -o FOLDER` wrote really deviates from
// the raster, measured from the bytes of its tiles by the tests' own judge. Prints JSON, a level an entry, finest first.
//
// The samples come from the raster floor, on the lattice and with the options that the manifest names. At most SAMPLES of a level
// are looked at (0: all), every n-th row and column of each tile: a maximum over some of them is a lower bound.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "pipeline/encode/decode.h"
#include "pipeline/faces/face.h"
#include "pipeline/tileset/implicit_tile.h"
#include "pipeline/tileset/manifest_json.h"
#include "raster/source.h"
#include "tests/whole/evaluator.h"

using namespace cordillera;
namespace fs = std::filesystem;

namespace {

template <class T>
T must(proto::Result<T> result) {
  if (!result.ok()) throw std::runtime_error(result.problem().line());
  return std::move(*result);
}

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path.string());
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

/// The raster as the build saw it: all samples of the finest lattice, 5 bytes each.
struct Truth {
  proto::Lattice lattice;
  proto::Samples samples;

  std::optional<double> operator()(std::int64_t i, std::int64_t j) const {
    const std::int32_t height = samples.at(i, j);
    if (height == proto::kNoHeight) return std::nullopt;
    return height * proto::kHeightStep_m;
  }
};

Truth truth_of(const std::string& raster, const proto::Manifest& manifest) {
  const auto source = must(raster::open_source(raster, manifest.name(), raster::Trust::operator_file, manifest.options()));
  Truth truth{{static_cast<int>(manifest.max_level())}, {}};
  const raster::Source::Window w = source->window(truth.lattice);
  truth.samples = must(source->sample(truth.lattice, w.west, w.south, static_cast<std::int32_t>(w.east - w.west + 1),
                                      static_cast<std::int32_t>(w.north - w.south + 1)));
  return truth;
}

/// The parts of the tile's closed rectangle where there are samples: two where data lies on both ends of the circle.
struct Part {
  whole::SampleWindow window;
  std::int64_t turn = 0;  ///< to be added to a column to find it in the samples
};
std::vector<Part> parts_of(const Truth& truth, const proto::TileAddress& tile) {
  const proto::Samples& s = truth.samples;
  const std::int64_t west = truth.lattice.west(tile), south = truth.lattice.south(tile), side = truth.lattice.tile_units(tile.z);
  std::vector<Part> parts;
  for (int turns = -1; turns <= 1; ++turns) {
    const std::int64_t turn = turns * truth.lattice.columns();
    const whole::SampleWindow w{std::max(west, s.west - turn), std::max(south, s.south),
                                std::min(west + side, s.west + s.columns - 1 - turn),
                                std::min(south + side, s.south + s.rows - 1)};
    if (w.west <= w.east && w.south <= w.north) parts.push_back({w, turn});
  }
  return parts;
}

struct TileFigures {
  std::size_t triangles = 0, drc_bytes = 0, glb_bytes = 0;
  double drc_max_m = 0, glb_max_m = 0, squares_m2 = 0;
  std::uint64_t samples = 0, unseen = 0;
  double max_m() const { return std::max(drc_max_m, glb_max_m); }
  std::int64_t worst_i = 0, worst_j = 0;  ///< finest lattice vertex of the greatest error
};

std::string drc_path(const proto::TileAddress& t) {
  return "tiles/" + std::to_string(t.z) + "/" + std::to_string(t.x) + "/" + std::to_string(t.y) + ".drc";
}
std::string glb_path(const proto::TileAddress& t) {
  return "tiles/" + std::string(1, pipeline::hemisphere_of(t)) + "/" + std::to_string(t.z) + "/" +
         std::to_string(pipeline::implicit_x(t)) + "/" + std::to_string(t.y) + ".glb";
}

TileFigures figures_of(const fs::path& folder, const proto::TileAddress& at, const Truth& truth, std::int64_t stride) {
  const std::string drc_bytes = read(folder / drc_path(at)), glb_bytes = read(folder / glb_path(at));
  const pipeline::DecodedDrc drc = must(pipeline::decode_drc(drc_bytes));
  const pipeline::DecodedGlb glb = must(pipeline::decode_glb(glb_bytes));
  if (proto::TileAddress{drc.z, drc.x, drc.y} != at) throw std::runtime_error(drc_path(at) + " names another tile");
  whole::DecodedTile tile{at, drc.side, {}, {}, {}, drc.triangles};
  const auto steps = static_cast<std::int32_t>(std::lround(drc.height_step * 1024));
  for (const auto& [u, v, h] : drc.points) tile.u.push_back(u), tile.v.push_back(v), tile.h.push_back(h * steps);
  const whole::DecodedSurface by_formula = whole::surface_of(tile);
  whole::DecodedSurface in_space{{}, glb.triangles};
  for (const proto::Vec3& p : glb.points) in_space.points.push_back({p.x, p.y, p.z});

  TileFigures figures{drc.triangles.size(), drc_bytes.size(), glb_bytes.size()};
  for (const Part& part : parts_of(truth, at)) {
    const auto height = [&](std::int64_t i, std::int64_t j) { return truth(i + part.turn, j); };
    const whole::Measured exact = whole::measure(by_formula, truth.lattice, at, height, part.window, stride);
    const whole::Measured rounded = whole::measure(in_space, truth.lattice, at, height, part.window, stride);
    const whole::Measured& worst = exact.max_m >= rounded.max_m ? exact : rounded;
    if (worst.max_m > figures.max_m()) figures.worst_i = worst.worst_i, figures.worst_j = worst.worst_j;
    figures.drc_max_m = std::max(figures.drc_max_m, exact.max_m);
    figures.glb_max_m = std::max(figures.glb_max_m, rounded.max_m);
    figures.squares_m2 += exact.rmse_m * exact.rmse_m * static_cast<double>(exact.samples);
    figures.samples += exact.samples;
    figures.unseen += exact.uncovered;
  }
  return figures;
}

std::map<int, std::vector<proto::TileAddress>, std::greater<>> tiles_in(const fs::path& folder) {
  std::map<int, std::vector<proto::TileAddress>, std::greater<>> levels;
  for (const auto& entry : fs::recursive_directory_iterator(folder / "tiles")) {
    if (entry.path().extension() != ".drc") continue;
    const auto found = pipeline::faces::find(fs::relative(entry.path(), folder).generic_string());
    if (!found) throw std::runtime_error(entry.path().string() + " is not a tile's name");
    levels[found->place.z].push_back({found->place.z, found->place.x, found->place.y});
  }
  for (auto& [z, tiles] : levels) std::sort(tiles.begin(), tiles.end());
  return levels;
}

/// Tiles are independent; sums are taken in their order afterwards.
std::vector<TileFigures> measure_all(const fs::path& folder, const std::vector<proto::TileAddress>& tiles, const Truth& truth,
                                     std::int64_t stride, unsigned threads) {
  std::vector<TileFigures> figures(tiles.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t k = next++; k < tiles.size(); k = next++) {
      try {
        figures[k] = figures_of(folder, tiles[k], truth, stride);
      } catch (const std::exception& error) {  // a figure left out would look like a good one
        std::fprintf(stderr, "remeasure: %s\n", error.what());
        std::_Exit(1);
      }
    }
  };
  std::vector<std::jthread> others;
  for (unsigned t = 1; t < threads; ++t) others.emplace_back(work);
  work();
  others.clear();
  return figures;
}

void print_level(int level, const std::vector<TileFigures>& tiles, std::int64_t stride) {
  TileFigures sum;
  for (const TileFigures& t : tiles) {
    sum.triangles += t.triangles, sum.drc_bytes += t.drc_bytes, sum.glb_bytes += t.glb_bytes;
    sum.samples += t.samples, sum.unseen += t.unseen, sum.squares_m2 += t.squares_m2;
    if (t.max_m() > sum.max_m()) sum.worst_i = t.worst_i, sum.worst_j = t.worst_j;
    sum.drc_max_m = std::max(sum.drc_max_m, t.drc_max_m);
    sum.glb_max_m = std::max(sum.glb_max_m, t.glb_max_m);
  }
  const double rmse = sum.samples > 0 ? std::sqrt(sum.squares_m2 / static_cast<double>(sum.samples)) : 0;
  std::printf(
      "{\"level\": %d, \"tiles\": %zu, \"triangles\": %zu, \"drc_bytes\": %zu, \"glb_bytes\": %zu, \"drc_max_m\": %.6f, "
      "\"glb_max_m\": %.6f, \"rmse_m\": %.6f, \"samples\": %zu, \"unseen\": %zu, \"stride\": %zu, \"worst_vertex\": [%d, %d]}",
      level, tiles.size(), sum.triangles, sum.drc_bytes, sum.glb_bytes, sum.drc_max_m, sum.glb_max_m, rmse,
      static_cast<std::size_t>(sum.samples), static_cast<std::size_t>(sum.unseen), static_cast<std::size_t>(stride),
      static_cast<int>(sum.worst_i), static_cast<int>(sum.worst_j));
}

int run(const std::string& raster, const fs::path& folder, double most_samples, unsigned threads) {
  const Truth truth = truth_of(raster, must(pipeline::parse_manifest_json(read(folder / "manifest.json"))));
  const auto count = static_cast<double>(truth.samples.height.size());
  const auto stride = most_samples > 0 ? static_cast<std::int64_t>(std::ceil(std::sqrt(std::max(1.0, count / most_samples)))) : 1;
  std::printf("{\"lattice_samples\": %.0f, \"levels\": [\n", count);
  bool first = true;
  for (const auto& [level, tiles] : tiles_in(folder)) {
    if (!first) std::printf(",\n");
    first = false;
    print_level(level, measure_all(folder, tiles, truth, stride, threads), stride);
  }
  std::printf("]}\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: remeasure RASTER FOLDER [SAMPLES] [THREADS]\n");
    return 2;
  }
  try {
    return run(argv[1], argv[2], argc > 3 ? std::atof(argv[3]) : 0,
               argc > 4 ? static_cast<unsigned>(std::max(1, std::atoi(argv[4]))) : 1);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "remeasure: %s\n", error.what());
    return 1;
  }
}
