// drc_bench FOLDER: where the bytes of a build's .drc tiles go, level by level. FOLDER is what `cordillera build --formats drc`
// wrote. Every tile is decoded and encoded again: as it is, at other speeds of Draco, and with positions on a coarser lattice,
// which shows what finer positions cost. Nothing is written.
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "pipeline/encode/draco_mesh.h"

namespace {

using namespace cordillera;
namespace fs = std::filesystem;

/// A way to encode: bits that u and v, and that h, are cut by, and Draco's speed. Nothing: as the tile is.
struct Way {
  std::string name;
  int plan_bits = 0, height_bits = 0, speed = pipeline::kDracoSpeed;
};

struct Sum {
  std::size_t bytes = 0, triangles = 0, tiles = 0;
  double encode_s = 0;
  double per_triangle() const { return static_cast<double>(bytes) / static_cast<double>(triangles); }
};

std::string contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

pipeline::LatticeMesh coarser(pipeline::LatticeMesh mesh, const Way& way) {
  for (auto& p : mesh.points) p = {p[0] >> way.plan_bits, p[1] >> way.plan_bits, p[2] >> way.height_bits};
  return mesh;
}

int bits_above(std::int32_t side) {
  int bits = 0;
  while (side >> (bits + 1) >= 256) ++bits;
  return bits;
}

void add(Sum& sum, const pipeline::LatticeMesh& mesh, int speed) {
  const auto begin = std::chrono::steady_clock::now();
  sum.bytes += pipeline::draco_encode(mesh, speed).size();
  sum.encode_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  sum.triangles += mesh.triangles.size();
  ++sum.tiles;
}

std::vector<Way> ways(std::int32_t side) {
  const int cell = bits_above(side);  // of u and v that lie below a cell of the level
  return {{"as it is", 0, 0},    {"no heights", 0, 31},    {"no plan", 31, 31},
          {"h / 4", 0, 2},       {"h / 16", 0, 4},         {"h / 64", 0, 6},
          {"h / 256", 0, 8},     {"u, v / cell", cell, 0}, {"u, v / cell, h / 64", cell, 6},
          {"speed 0", 0, 0, 0},  {"speed 3", 0, 0, 3},     {"speed 7", 0, 0, 7},
          {"speed 10", 0, 0, 10}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "drc_bench FOLDER\n");
    return 2;
  }
  std::map<int, std::vector<Sum>> levels;
  for (const auto& entry : fs::recursive_directory_iterator(argv[1])) {
    if (entry.path().extension() != ".drc") continue;
    const auto mesh = pipeline::draco_decode_lattice(contents(entry.path()));
    if (!mesh.ok()) {
      std::fprintf(stderr, "%s: %s\n", entry.path().c_str(), mesh.problem().line().c_str());
      return 1;
    }
    const std::vector<Way> all = ways(mesh->side);
    std::vector<Sum>& sums = levels[mesh->z];
    sums.resize(all.size());
    for (std::size_t k = 0; k < all.size(); ++k) add(sums[k], coarser(*mesh, all[k]), all[k].speed);
  }
  const std::vector<Way> all = ways(256);
  std::printf("# bytes a triangle\n%-22s", "level");
  for (const auto& [z, sums] : levels) std::printf("%8d", z);
  std::printf("\n%-22s", "triangles");
  for (const auto& [z, sums] : levels) std::printf("%8zu", sums.front().triangles);
  std::printf("\n");
  for (std::size_t k = 0; k < all.size(); ++k) {
    std::printf("%-22s", all[k].name.c_str());
    Sum whole;
    for (const auto& [z, sums] : levels) {
      std::printf("%8.2f", sums[k].per_triangle());
      whole.bytes += sums[k].bytes, whole.triangles += sums[k].triangles, whole.encode_s += sums[k].encode_s;
    }
    std::printf("  all %.3f, %.0f ns a triangle\n", whole.per_triangle(),
                1e9 * whole.encode_s / static_cast<double>(whole.triangles));
  }
  return 0;
}
