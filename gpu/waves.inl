// The driver of strategy `waves`; included by waves_host.cpp and waves_cuda.cu only.
#include "gpu/waves.h"

namespace cordillera::gpu {

template <class Backend>
std::vector<proto::TileMesh> WaveSimplifier<Backend>::simplify(std::span<const SimplifyJob> jobs) {
  std::vector<proto::TileMesh> results;
  results.reserve(jobs.size());
  std::size_t from = 0, vertices = 0;
  for (std::size_t j = 0; j < jobs.size(); ++j) {
    vertices += jobs[j].input->vertices();
    if (vertices < backend_.vertices_at_once() && j + 1 < jobs.size()) continue;
    simplify_batch(jobs.subspan(from, j + 1 - from), results);
    from = j + 1;
    vertices = 0;
  }
  return results;
}

template <class Backend>
void WaveSimplifier<Backend>::simplify_batch(std::span<const SimplifyJob> jobs, std::vector<proto::TileMesh>& results) {
  BatchMesh mesh;
  WindowPass pass;
  for (const SimplifyJob& job : jobs) {
    mesh.append(job);
    pass.rules.push_back(rules_of(job));
    pass.schedules.push_back(schedule_of(job));
  }
  backend_.begin(mesh);
  std::vector<std::size_t> alive_before(jobs.size(), SIZE_MAX);
  for (int p = 0; p < kMostPasses; ++p) {
    pass.cut = {};
    std::vector<std::uint32_t> alive;
    for (std::size_t t = 0; t < jobs.size(); ++t) {
      alive.clear();
      for (std::size_t v = mesh.first[t]; v < mesh.first[t + 1]; ++v) {
        if (!(mesh.mark[v] & kGone)) alive.push_back(static_cast<std::uint32_t>(v));
      }
      // Plain terrain goes on while passes still pay; a rule of the tile alone, whatever it is batched with.
      if (p >= kPasses && 10 * alive.size() > 9 * alive_before[t]) continue;
      alive_before[t] = alive.size();
      cut_windows(alive, mesh.x.data(), mesh.y.data(), jobs[t].input->side, p, static_cast<std::uint32_t>(t), pass.cut);
    }
    if (pass.cut.windows.empty()) break;
    backend_.run(mesh, pass);
  }
  backend_.finish(mesh);
  for (std::size_t t = 0; t < jobs.size(); ++t) results.push_back(extract(mesh, t, jobs[t]));
}

}  // namespace cordillera::gpu
