#include <cstdlib>

#include "gpu/device/device_choice.h"
#include "gpu/exact/simplify_block.h"
#include "server/doctor/doctor.h"
#include "server/metrics/gpu_memory.h"

namespace cordillera::server::doctor {
namespace {

/// What may help where there is a GPU and problem is why it does no work.
std::string advice(const proto::Problem& problem) {
  if (problem.detail == gpu::built_without_cuda().detail) return "a build of the program with CUDA";
  const char* visible = std::getenv("CUDA_VISIBLE_DEVICES");
  return "a newer driver, memory of the GPU that is free, or " +
         (visible == nullptr ? std::string("the right to use it")
                             : "another CUDA_VISIBLE_DEVICES, which is \"" + std::string(visible) + "\"");
}

}  // namespace

void check_gpu(const Settings& settings, Findings& findings) {
  const auto cards = metrics::gpus();
  for (const metrics::Gpu& card : cards) {
    findings.push_back(Finding{"driver", Health::good,
                               card.name + ", driver " + card.driver + ", " + std::to_string((card.total - card.used) >> 20) +
                                   " of " + std::to_string(card.total >> 20) + " MiB free",
                               ""});
  }
  const std::string& asked = settings.build.device();
  if (asked == "cpu") return;
  const bool demanded = !asked.empty() && asked != "auto";
  const auto works = gpu::exact::make_block_simplifier(demanded ? asked : "cuda");
  if (works) {
    findings.push_back(Finding{"GPU", Health::good, (*works)->device() + " works", ""});
  } else if (demanded) {
    findings.push_back(Finding{"GPU", Health::bad, works.problem().detail, "--device auto"});
  } else if (!cards.empty()) {
    findings.push_back(Finding{"GPU", Health::warning, works.problem().detail,
                               advice(works.problem()) + "; until then the CPU does the work, to the same bytes"});
  } else {
    findings.push_back(Finding{"GPU", Health::good, "none: the CPU does the work, to the same bytes", ""});
  }
}

}  // namespace cordillera::server::doctor
