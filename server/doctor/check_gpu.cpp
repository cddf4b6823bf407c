#include "gpu/simplify.h"
#include "server/doctor/doctor.h"
#include "server/metrics/gpu_memory.h"

namespace cordillera::server::doctor {

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
  const auto works = gpu::make_simplifier(demanded ? asked : "cuda");
  if (works) {
    findings.push_back(Finding{"GPU", Health::good, (*works)->device() + " works", ""});
  } else if (demanded) {
    findings.push_back(Finding{"GPU", Health::bad, works.problem().detail, "--device auto"});
  } else if (!cards.empty()) {
    findings.push_back(Finding{"GPU", Health::warning, works.problem().detail,
                               "a build of the program with CUDA; until then the CPU does the work, to the same bytes"});
  } else {
    findings.push_back(Finding{"GPU", Health::good, "none: the CPU does the work, to the same bytes", ""});
  }
}

}  // namespace cordillera::server::doctor
