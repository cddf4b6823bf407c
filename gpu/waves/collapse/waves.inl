// The driver of strategy `waves`; included by waves_host.cpp and waves_cuda.cu only.
#include "gpu/waves/collapse/batch.inl"
#include "gpu/waves/collapse/waves.h"

namespace cordillera::gpu {

template <class Device>
std::vector<proto::TileMesh> WaveSimplifier<Device>::simplify(std::span<const SimplifyJob> jobs) {
  std::vector<proto::TileMesh> results(jobs.size());
  device_->use();
  stages_.clear();
  watch_.lap();
  std::size_t from = 0, vertices = 0;
  for (std::size_t j = 0; j < jobs.size(); ++j) {
    vertices += jobs[j].input->vertices();
    if (vertices < device_->vertices_at_once() && j + 1 < jobs.size()) continue;
    simplify_batch(jobs.subspan(from, j + 1 - from), {results.data() + from, j + 1 - from});
    from = j + 1;
    vertices = 0;
  }
  return results;
}

template <class Device>
void WaveSimplifier<Device>::simplify_batch(std::span<const SimplifyJob> jobs, std::span<proto::TileMesh> results) {
  batch_.load(jobs, parallel_);
  end_stage("load");
  batch_.start(jobs);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const std::span<const std::uint32_t> vertices = batch_.alive(pass == 0);
    end_stage(pass == 0 ? "start" : "pass " + std::to_string(pass));
    const WindowCut cut = cutter_.cut(*device_, batch_.view(), batch_.tiles(), vertices, pass, kPasses);
    if (cut.in_work == 0) break;
    device_->simplify(batch_.view(), cut, batch_.tiles(), batch_.row_width());
  }
  batch_.unload();
  end_stage("unload");
  parallel_(jobs.size(), [&](std::size_t t) { results[t] = finish_tile(jobs[t], batch_.survivors(t)); });
  end_stage("mend");
}

}  // namespace cordillera::gpu
