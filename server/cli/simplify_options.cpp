// What the options of cordillera simplify may say.
#include <cmath>

#include "server/cli/simplify_command.h"
#include "server/options/option_values.h"

namespace cordillera::server {
namespace {

using gpu::fit::MeshTarget;
using gpu::fit::Quality;

constexpr double kMostCounted = 4294967295.0, kGreatestError = 1e9;

proto::Result<double> share(const std::string& text) {
  double value = 0;
  Complaint complaint = read_number(text, {0, 1}, &value);
  if (!complaint && value == 0) complaint = "nothing would be left";
  if (complaint) return wrong_value("--keep", text, *complaint, "a number above 0 up to 1");
  return value;
}

proto::Result<std::uint64_t> count(const std::string& name, const std::string& text) {
  double value = 0;
  Complaint complaint = read_number(text, {1, kMostCounted}, &value);
  if (!complaint && value != std::floor(value)) complaint = "not a whole number";
  if (complaint) return wrong_value(name, text, *complaint, "a whole number from 1 on");
  return static_cast<std::uint64_t>(value);
}

/// One size is wanted, neither none nor several. usual: the option that a problem names.
std::optional<proto::Problem> check_wishes(int given, const std::string& accepted, const std::string& usual) {
  if (given == 1) return std::nullopt;
  if (given == 0) return proto::Problem{"usage", "simplify needs to know how small the mesh is to be", accepted, usual};
  return proto::Problem{"options-conflict", "there are several wishes how small the mesh is to be", accepted, usual};
}

proto::Result<MeshTarget> target_of(const SimplifyLine& line) {
  const std::string accepted = "one of --keep SHARE, --triangles N, --error METRES";
  if (!line.collapses.empty()) {
    return proto::Problem{"options-conflict", "waves does not count collapses", "--strategy cleap or sequential; or " + accepted,
                          "--collapses"};
  }
  if (!line.cleap.empty()) {
    const std::string name = "--" + line.cleap.begin()->first;
    return proto::Problem{"options-conflict", name + " is no option of waves", "--strategy cleap or sequential", name};
  }
  const int given = !line.keep.empty() + !line.triangles.empty() + !line.error.empty();
  if (auto problem = check_wishes(given, accepted, "--keep")) return *problem;
  if (!line.keep.empty()) {
    const auto kept = share(line.keep);
    return kept ? proto::Result<MeshTarget>(MeshTarget::keep(*kept)) : kept.problem();
  }
  if (!line.triangles.empty()) {
    const auto triangles = count("--triangles", line.triangles);
    return triangles ? proto::Result<MeshTarget>(MeshTarget::triangles(*triangles)) : triangles.problem();
  }
  double error_m = 0;
  if (const Complaint complaint = read_number(line.error, {0, kGreatestError}, &error_m))
    return wrong_value("--error", line.error, *complaint, "metres, 0 or more");
  return MeshTarget::error_m(error_m);
}

/// The published algorithm knows no error, and no quality but its own options.
proto::Result<CleapRequest> published_request(const SimplifyLine& line, const std::string& strategy) {
  const std::string accepted = "one of --collapses N, --keep SHARE, --triangles N";
  if (!line.error.empty()) {
    return proto::Problem{"options-conflict", strategy + " measures no error and can promise none",
                          accepted + "; or --strategy waves", "--error"};
  }
  if (line.quality != "default") {
    return proto::Problem{"options-conflict", "--quality is an option of waves", "--strategy waves", "--quality"};
  }
  const int given = !line.keep.empty() + !line.triangles.empty() + !line.collapses.empty();
  if (auto problem = check_wishes(given, accepted, "--collapses")) return *problem;
  auto request = cleap_request(strategy, line.cleap);
  if (!request) return request;
  if (!line.keep.empty()) {
    const auto kept = share(line.keep);
    if (!kept) return kept.problem();
    request->keep = *kept;
    return request;
  }
  const bool collapses = !line.collapses.empty();
  const auto counted = collapses ? count("--collapses", line.collapses) : count("--triangles", line.triangles);
  if (!counted) return counted.problem();
  (collapses ? request->target.collapses : request->target.triangles) = *counted;
  return request;
}

proto::Result<Quality> quality_of(const std::string& text) {
  std::string choice;
  if (const Complaint complaint = read_choice(text, {"fast", "default", "best", "minimax"}, &choice)) {
    return wrong_value("--quality", text, *complaint, "fast, default, best or minimax");
  }
  if (choice == "fast") return Quality::fast;
  if (choice == "best") return Quality::best;
  return choice == "minimax" ? Quality::minimax : Quality::default_;
}

}  // namespace

proto::Result<SimplifyRequest> simplify_request(const SimplifyLine& line) {
  SimplifyRequest request;
  if (line.output.empty()) {
    return proto::Problem{"usage", "simplify needs to know where to write", "-o FILE.ply, -o FILE.off or -o FILE.obj",
                          "--output"};
  }
  std::string strategy;
  if (const Complaint complaint = read_choice(line.strategy, {"waves", "cleap", "sequential"}, &strategy)) {
    return wrong_value("--strategy", line.strategy, *complaint, "waves, cleap or sequential");
  }
  request.strategy = strategy;
  if (strategy == "waves") {
    const auto target = target_of(line);
    if (!target) return target.problem();
    request.target = *target;
    const auto quality = quality_of(line.quality);
    if (!quality) return quality.problem();
    request.options.quality = *quality;
  } else {
    const auto published = published_request(line, strategy);
    if (!published) return published.problem();
    request.cleap = *published;
  }
  if (const Complaint complaint = read_device(line.device, &request.options.device)) {
    return wrong_value("--device", line.device, *complaint, "auto, cpu, cuda or cuda:N");
  }
  std::uint32_t threads = 0;
  if (const Complaint complaint = read_whole(line.threads, {0, 1024}, &threads)) {
    return wrong_value("--threads", line.threads, *complaint, "0 to 1024");
  }
  request.threads = request.options.threads = threads;
  if (request.cleap) {
    request.cleap->options.device = strategy == "sequential" && line.device == "auto" ? "cpu" : request.options.device;
    request.cleap->options.threads = strategy == "sequential" ? 1 : threads;
  }
  return request;
}

}  // namespace cordillera::server
