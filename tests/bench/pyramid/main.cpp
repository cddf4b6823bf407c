// pyramid_bench [device] [tiles across] [tolerance_m]: hashes and times of six terrains; a table on stdout, JSON with --json.
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tests/bench/pyramid/pyramid.h"

using namespace cordillera;

int main(int argc, char** argv) {
  const std::string device = argc > 1 ? argv[1] : "auto";
  const int across = argc > 2 ? std::atoi(argv[2]) : 4;
  const float tolerance_m = argc > 3 ? static_cast<float>(std::atof(argv[3])) : 4;
  const bool json = argc > 4 && std::strcmp(argv[4], "--json") == 0;
  auto simplifier = gpu::make_simplifier(device);
  if (!simplifier.ok()) {
    std::fprintf(stderr, "%s\n", simplifier.problem().line().c_str());
    return 1;
  }
  std::printf(json ? "[" : "# %s, %d x %d tiles, tolerance %g m\n# terrain level tiles vertices-in vertices triangles prepare-s simplify-s hash\n",
              (*simplifier)->device().c_str(), across, across, static_cast<double>(tolerance_m));
  bool first = true;
  for (int kind = 0; kind < 6; ++kind) {
    for (const bench::LevelFigures& level : bench::run_pyramid(static_cast<bench::Terrain>(kind), across, tolerance_m, **simplifier)) {
      if (json) {
        std::printf("%s\n{\"terrain\":\"%s\",\"level\":%d,\"vertices_in\":%zu,\"vertices\":%zu,\"simplify_seconds\":%.6f,\"hash\":\"%016" PRIx64 "\"}",
                    first ? "" : ",", bench::kTerrainNames[kind].data(), level.level, level.vertices_in, level.vertices, level.simplify_s, level.hash);
      } else {
        std::printf("%s %d %zu %zu %zu %zu %.3f %.3f %016" PRIx64 "\n", bench::kTerrainNames[kind].data(), level.level, level.tiles,
                    level.vertices_in, level.vertices, level.triangles, level.prepare_s, level.simplify_s, level.hash);
      }
      first = false;
    }
  }
  if (json) std::printf("]\n");
  return 0;
}
