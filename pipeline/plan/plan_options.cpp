#include "pipeline/plan/plan_options.h"

#include <algorithm>

#include "gpu/simplify.h"
#include "pipeline/plan/plan.h"
#include "proto/lattice.h"

namespace cordillera::pipeline {

std::optional<std::string> wrong_with_keep(std::span<const double> shares) {
  if (shares.size() > proto::kMaxLevel + 1) return "more shares than there can be levels";
  for (std::size_t k = 0; k < shares.size(); ++k) {
    const std::string share = "share " + std::to_string(k + 1);
    if (!(shares[k] > 0)) return share + " is not above 0";
    if (shares[k] > 1) return share + " is above 1";
    if (k > 0 && shares[k] > shares[k - 1]) return share + " is greater than the one before";
  }
  return std::nullopt;
}

proto::Result<void> check_options(const proto::BuildOptions& options) {
  if (options.has_error() && options.keep_size() > 0) {
    return proto::Problem{"options-conflict", "error and keep are both given", "one of them", "keep"};
  }
  if (options.has_error() && !(options.error() >= kLeastError_m && options.error() <= kGreatestError_m)) {
    return proto::Problem{"option-invalid", "error is not a positive number of metres", "0.01 to 1000000", "error"};
  }
  const std::span<const double> shares(options.keep().data(), static_cast<std::size_t>(options.keep_size()));
  if (const auto wrong = wrong_with_keep(shares))
    return proto::Problem{"option-invalid", "keep: " + *wrong, "numbers above 0 up to 1, falling, finest level first", "keep"};
  if (auto problem = gpu::check_strategy(named_strategy(options), options.device())) return *problem;
  const std::string& quality = options.quality();
  if (!quality.empty() && std::find(kQualities.begin(), kQualities.end(), quality) == kQualities.end()) {
    return proto::Problem{"option-invalid", "quality \"" + quality + "\" is not known", "fast, default or best", "quality"};
  }
  return {};
}

}  // namespace cordillera::pipeline
