#include "pipeline/store/levels_shown.h"

#include <algorithm>

namespace cordillera::pipeline {
namespace {

constexpr double kEnough = 0.5;  // of what the finest level shows

/// From the coarsest level on, the finest one that shows less than so much of it.
std::optional<int> last_below(const proto::Manifest& manifest, double share) {
  std::optional<int> last;
  for (auto level = manifest.levels().rbegin(); level != manifest.levels().rend(); ++level) {
    if (!level->has_shown_share() || level->shown_share() >= share) break;
    last = static_cast<int>(level->level());
  }
  return last;
}

std::string levels_text(int first, int last) {
  return first == last ? "level " + std::to_string(first) : "levels " + std::to_string(first) + " to " + std::to_string(last);
}

}  // namespace

const proto::LevelSummary* summary_of(const proto::Manifest& manifest, int level) {
  const auto& levels = manifest.levels();
  const auto is_it = [level](const proto::LevelSummary& summary) { return static_cast<int>(summary.level()) == level; };
  const auto found = std::find_if(levels.begin(), levels.end(), is_it);
  return found == levels.end() ? nullptr : &*found;
}

std::optional<double> stated_error_m(const proto::Manifest& manifest, int level) {
  const proto::LevelSummary* const summary = manifest.provisional() ? nullptr : summary_of(manifest, level);
  return summary != nullptr && summary->tiles() > 0 ? std::optional(summary->stated_max_error()) : std::nullopt;
}

std::optional<int> last_sparse_level(const proto::Manifest& manifest) { return last_below(manifest, kEnough); }

std::string note_on_sparse_levels(const proto::Manifest& manifest) {
  constexpr double kHardlyAny = 0.001;
  const auto last = last_sparse_level(manifest);
  if (!last) return "";
  const auto coarsest = static_cast<int>(manifest.levels().rbegin()->level());
  const auto empty = last_below(manifest, kHardlyAny);
  const std::string verb = coarsest == *last ? " shows " : " show ",
                    more = empty && *empty != *last ? ", and " + levels_text(coarsest, *empty) + " hardly any" : "";
  return levels_text(coarsest, *last) + verb + (empty == last ? "hardly any" : "less than half") + " of the data" + more +
         ": it lies in strips or spots narrower than two cells there, where rims may move by one";
}

}  // namespace cordillera::pipeline
