// hmm: greedy insertion into a height map. Its own program reads 16-bit images; here it gets the heights as they are.
#include <algorithm>
#include <memory>

#include "heightmap.h"
#include "triangulator.h"

#include "tests/bench/compare/driver.h"

namespace {

using namespace cordillera;

/// The mesh as a height map: rows of vertices, the first of them its first.
struct Map {
  int columns = 0, rows = 0;
  double west = 0, south = 0, cell_x = 0, cell_y = 0, low = 0, range = 1;
};

Map map_of(const proto::TriangleMesh& mesh) {
  Map map;
  const auto end = std::find_if(mesh.y.begin(), mesh.y.end(), [&](double y) { return y != mesh.y[0]; });
  map.columns = static_cast<int>(end - mesh.y.begin());
  map.rows = static_cast<int>(mesh.vertices()) / std::max(map.columns, 1);
  if (map.columns < 2 || map.rows < 2 || static_cast<std::size_t>(map.columns) * map.rows != mesh.vertices()) {
    throw std::runtime_error("the mesh is no grid");
  }
  map.west = mesh.x[0];
  map.south = mesh.y[0];
  map.cell_x = (mesh.x[map.columns - 1] - mesh.x[0]) / (map.columns - 1);
  map.cell_y = (mesh.y.back() - mesh.y[0]) / (map.rows - 1);
  const auto [low, high] = std::minmax_element(mesh.z.begin(), mesh.z.end());
  map.low = *low;
  map.range = std::max(*high - *low, 1e-9);
  return map;
}

}  // namespace

int main(int count, char** words) {
  return bench::drive(count, words, [](const bench::Task& task, bench::Stopwatch& watch) {
    const Map map = map_of(task.mesh);
    std::vector<float> heights;
    for (const double z : task.mesh.z) heights.push_back(static_cast<float>((z - map.low) / map.range));
    const auto heightmap = std::make_shared<Heightmap>(map.columns, map.rows, heights);
    watch.start();
    Triangulator triangulator(heightmap);
    triangulator.Run(0, static_cast<int>(task.triangles), 0);
    watch.stop();
    proto::TriangleMesh out;
    // It draws rows downwards and gives y upwards.
    for (const auto& p : triangulator.Points(1)) {
      out.x.push_back(map.west + map.cell_x * p.x);
      out.y.push_back(map.south + map.cell_y * (map.rows - 1 - p.y));
      out.z.push_back(map.low + map.range * p.z);
    }
    for (const auto& t : triangulator.Triangles()) {
      out.triangles.push_back(
          {static_cast<std::uint32_t>(t.x), static_cast<std::uint32_t>(t.z), static_cast<std::uint32_t>(t.y)});
    }
    return out;
  });
}
