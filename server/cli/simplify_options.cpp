// What the options of cordillera simplify may say.
#include <cmath>

#include "server/cli/simplify_command.h"
#include "server/options/option_values.h"

namespace cordillera::server {
namespace {

using gpu::fit::MeshTarget;
using gpu::fit::Quality;

constexpr double kMostCounted = 4294967295.0, kGreatestError = 1e9;

Complaint take_share(std::string_view text, SimplifyWish& wish) {
  if (Complaint complaint = read_number(text, {0, 1}, &wish.keep.emplace())) return complaint;
  return *wish.keep == 0 ? Complaint("nothing would be left") : std::nullopt;
}

template <std::optional<std::uint64_t> SimplifyWish::*into>
Complaint take_count(std::string_view text, SimplifyWish& wish) {
  double value = 0;
  if (Complaint complaint = read_number(text, {1, kMostCounted}, &value)) return complaint;
  if (value != std::floor(value)) return "not a whole number";
  wish.*into = static_cast<std::uint64_t>(value);
  return std::nullopt;
}

Complaint take_error(std::string_view text, SimplifyWish& wish) {
  return read_number(text, {0, kGreatestError}, &wish.error_m.emplace());
}

std::vector<OptionOf<SimplifyWish>> make_simplify_options() {
  const auto choice = [](std::vector<std::string> names, std::string SimplifyWish::*into) {
    return [names, into](std::string_view text, SimplifyWish& wish) { return read_choice(text, names, &(wish.*into)); };
  };
  const std::vector<std::string> qualities = {"fast", "default", "best", "minimax"},
                                 strategies = {"waves", "cleap", "sequential"};
  std::vector<OptionOf<SimplifyWish>> all = {
      {"keep", "SHARE", "keep this share of the triangles", "a number above 0 up to 1", take_share},
      {"triangles", "N", "keep so many triangles", "a whole number from 1 on", take_count<&SimplifyWish::triangles>},
      {"error", "METRES", "keep as few as stay within this distance of every vertex, along z", "metres, 0 or more", take_error},
      {"quality", "QUALITY", "what the time is spent on", "fast, default, best or minimax",
       choice(qualities, &SimplifyWish::quality)},
      {"strategy", "STRATEGY", "how; cleap, sequential: the published algorithm", "waves, cleap or sequential",
       choice(strategies, &SimplifyWish::strategy)},
      {"collapses", "N", "cleap, sequential: collapse so many edges", "a whole number from 1 on",
       take_count<&SimplifyWish::collapses>},
      {"device", "DEVICE", "what computes", "auto, cpu, cuda or cuda:N",
       [](std::string_view text, SimplifyWish& wish) { return read_device(text, &wish.device); }},
      whole_number<SimplifyWish>("threads", "N", "threads that measure the result; 0: one for each usable core", {0, 1024},
                                 &SimplifyWish::threads),
  };
  for (OptionOf<SimplifyWish>& option : lifted(cleap_options(), &SimplifyWish::cleap)) {
    option.help = "cleap, sequential: " + option.help;
    all.push_back(std::move(option));
  }
  return all;
}

/// One size is wanted, neither none nor several. usual: the option that a problem names.
std::optional<proto::Problem> check_sizes(int given, const std::string& accepted, const std::string& usual) {
  if (given == 1) return std::nullopt;
  if (given == 0) return proto::Problem{"usage", "simplify needs to know how small the mesh is to be", accepted, usual};
  return proto::Problem{"options-conflict", "there are several wishes how small the mesh is to be", accepted, usual};
}

proto::Result<MeshTarget> target_of(const Given& given, const SimplifyWish& wish) {
  const std::string accepted = "one of --keep SHARE, --triangles N, --error METRES";
  if (wish.collapses) {
    return proto::Problem{"options-conflict", "waves does not count collapses", "--strategy cleap or sequential; or " + accepted,
                          "--collapses"};
  }
  for (const auto& [name, value] : given) {
    if (!place_of(name, names_in(cleap_options()), Spelling::command_line)) continue;
    return proto::Problem{"options-conflict", name + " is no option of waves", "--strategy cleap or sequential", name};
  }
  const int sizes = wish.keep.has_value() + wish.triangles.has_value() + wish.error_m.has_value();
  if (auto problem = check_sizes(sizes, accepted, "--keep")) return *problem;
  if (wish.keep) return MeshTarget::keep(*wish.keep);
  if (wish.triangles) return MeshTarget::triangles(*wish.triangles);
  return MeshTarget::error_m(*wish.error_m);
}

/// The published algorithm knows no error, and no quality but its own options.
proto::Result<CleapRequest> published_request(const Given& given, const SimplifyWish& wish) {
  const std::string accepted = "one of --collapses N, --keep SHARE, --triangles N";
  if (wish.error_m) {
    return proto::Problem{"options-conflict", wish.strategy + " measures no error and can promise none",
                          accepted + "; or --strategy waves", "--error"};
  }
  if (wish.quality != "default") {
    return proto::Problem{"options-conflict", "--quality is an option of waves", "--strategy waves", "--quality"};
  }
  const int sizes = wish.keep.has_value() + wish.triangles.has_value() + wish.collapses.has_value();
  if (auto problem = check_sizes(sizes, accepted, "--collapses")) return *problem;
  auto request = checked_cleap(wish.cleap, wish.strategy, given);
  if (!request) return request;
  request->keep = wish.keep.value_or(request->keep);
  request->target.collapses = wish.collapses.value_or(request->target.collapses);
  request->target.triangles = wish.triangles.value_or(request->target.triangles);
  return request;
}

Quality quality_of(const std::string& text) {
  if (text == "fast") return Quality::fast;
  if (text == "best") return Quality::best;
  return text == "minimax" ? Quality::minimax : Quality::default_;
}

}  // namespace

const std::vector<OptionOf<SimplifyWish>>& simplify_options() {
  static const std::vector<OptionOf<SimplifyWish>> kOptions = make_simplify_options();
  return kOptions;
}

proto::Result<SimplifyRequest> simplify_request(const SimplifyLine& line) {
  if (line.output.empty()) {
    return proto::Problem{"usage", "simplify needs to know where to write", "-o FILE.ply, -o FILE.off or -o FILE.obj",
                          "--output"};
  }
  SimplifyWish wish;
  if (auto problem = read_options(simplify_options(), line.given, {.spelling = Spelling::command_line}, wish)) return *problem;
  SimplifyRequest request;
  request.strategy = wish.strategy;
  request.threads = request.options.threads = wish.threads;
  request.options.device = wish.device;
  if (wish.strategy == "waves") {
    const auto target = target_of(line.given, wish);
    if (!target) return target.problem();
    request.target = *target;
    request.options.quality = quality_of(wish.quality);
    return request;
  }
  auto published = published_request(line.given, wish);
  if (!published) return published.problem();
  const bool one_by_one = wish.strategy == "sequential";
  published->options.device = one_by_one && wish.device == "auto" ? "cpu" : wish.device;
  published->options.threads = one_by_one ? 1 : wish.threads;
  request.cleap = *published;
  return request;
}

}  // namespace cordillera::server
