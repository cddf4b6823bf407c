// meshoptimizer's meshopt_simplify, without an error limit.
#include <meshoptimizer.h>

#include "tests/bench/compare/driver.h"

/// Relative to the extent.
constexpr float kNoLimit = 1e10f;

int main(int count, char** words) {
  using namespace cordillera;
  return bench::drive(count, words, [](const bench::Task& task, bench::Stopwatch& watch) {
    std::vector<float> positions;
    for (std::size_t v = 0; v < task.mesh.vertices(); ++v) {
      for (const auto* axis : {&task.mesh.x, &task.mesh.y, &task.mesh.z}) positions.push_back(static_cast<float>((*axis)[v]));
    }
    std::vector<unsigned> indices;
    for (const auto& t : task.mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
    std::vector<unsigned> left(indices.size());
    watch.start();
    left.resize(meshopt_simplify(left.data(), indices.data(), indices.size(), positions.data(), task.mesh.vertices(),
                                 3 * sizeof(float), 3 * task.triangles, kNoLimit, 0, nullptr));
    watch.stop();
    // Vertices that are left, in the order of their first use.
    proto::TriangleMesh out;
    std::vector<std::uint32_t> place(task.mesh.vertices(), ~0u);
    for (std::size_t k = 0; k < left.size(); ++k) {
      std::uint32_t& to = place[left[k]];
      if (to == ~0u) {
        to = static_cast<std::uint32_t>(out.vertices());
        out.x.push_back(positions[3 * left[k]]);
        out.y.push_back(positions[3 * left[k] + 1]);
        out.z.push_back(positions[3 * left[k] + 2]);
      }
      if (k % 3 == 0) out.triangles.emplace_back();
      out.triangles.back()[k % 3] = to;
    }
    return out;
  });
}
