#include "pipeline/build/pilot.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <future>
#include <optional>
#include <vector>

#include "gpu/simplify.h"
#include "pipeline/build/build.h"
#include "pipeline/plan/plan.h"
#include "pipeline/plan/plan_options.h"
#include "pipeline/plan/sample_places.h"

namespace cordillera::pipeline {
namespace {

/// Of a dataset of more than kWholeTiles: blocks of the finest tiles below a node so many levels up, spread over the data. The
/// search begins with the first few. One of exact is a tile that is simplified for coarser levels, too; where tiles are made one
/// by one it ends at its node.
struct SampleSize {
  std::size_t blocks, first;
  int levels_up;
};
constexpr SampleSize kSample{kPilotTiles, kPilotTiles / 4, 0}, kSampleOfTiles{4, 4, 2};
constexpr double kLeastTriangles = 500;                  // in a block: with fewer its sides would count for too much
constexpr int kMostRunsOfFirst = 7, kMostRunsOfAll = 4;  // one of which often is enough
/// To the finest level's share, relative; each coarser level may be that much farther off than the one below it.
constexpr double kClose = 0.01, kLessClose = 1.5;
constexpr double kFewTriangles = 4;                  // are close, too
constexpr double kLongWay = 1.25;                    // between two tolerances that leave as many triangles
constexpr double kLongestStep = 32;                  // of a tolerance, from run to run
constexpr double kLeastPower = 0.3, kMostPower = 8;  // of a tolerance, that the odds of a triangle fall by
/// A level is made of the one below it: what was learned of its tolerance is forgotten where that has changed by as much.
constexpr double kSameBelow = 1.03;

/// To a thousandth: logarithms may differ by their last bit from machine to machine.
double rounded(double value) {
  constexpr int kBits = 10;
  int exponent = 0;
  const double fraction = std::frexp(value, &exponent);
  return std::ldexp(std::nearbyint(std::ldexp(fraction, kBits)), exponent - kBits);
}

/// What a tolerance gave.
struct Tried {
  double target = 0, triangles = 0;
};

/// The search for a level's tolerance. Where few triangles of the grid are left, they go as some power of it, and where nearly
/// all are, those that are missing do: so it is by the odds, which are left over missing.
struct SearchedLevel {
  double grid = 0, wanted = 0;  ///< triangles
  double close = 0;             ///< to that, relative
  double least = 0, most = 0;   ///< tolerances that there can be
  double target = 0;            ///< to be tried next
  double power = 1;             ///< of the tolerance, that the odds have fallen by
  double useless = INFINITY;    ///< tolerances from here on leave no fewer triangles than this one
  std::optional<Tried> last, too_many, too_few;

  /// Whether nothing better is to be had: rims and sides need what they need, and even ground has no more.
  bool is_there(double triangles) const {
    return std::abs(triangles - wanted) < std::max(close * wanted, kFewTriangles) ||
           (triangles > wanted && (target >= most || target == useless)) || (triangles < wanted && target <= least);
  }
  double off(double triangles) const { return is_there(triangles) ? 0 : std::abs(std::log(std::max(triangles, 1.0) / wanted)); }

  /// What follows of target, which gave so many.
  void learn(double triangles) {
    const Tried now{target, triangles};
    // Rims and sides need what they need: more than that would only be farther off.
    if (last && triangles > wanted && triangles >= last->triangles && target > kLongWay * last->target) useless = last->target;
    (triangles > wanted ? too_many : too_few) = now;
    double next = beyond(now);
    if (too_many && too_few && !(next > too_many->target && next < too_few->target)) next = between(*too_many, *too_few);
    last = now;
    if (is_there(triangles)) return;
    target = std::min(std::clamp(rounded(next), least, most), useless);
  }
  void forget_bounds() { too_many.reset(), too_few.reset(); }
  void forget_all_but_power() { forget_bounds(), last.reset(), useless = INFINITY; }

 private:
  double odds(double triangles) const {
    const double left = std::clamp(triangles, 0.5, std::max(grid - 0.5, 0.5));
    return left / std::max(grid - left, 0.5);
  }
  /// Not too near to either: that would teach little.
  double between(const Tried& a, const Tried& b) const {
    constexpr double kLeastShare = 0.05;
    const double from = odds(a.triangles), to = odds(b.triangles);
    const double share = from == to ? 0.5 : std::log(from / odds(wanted)) / std::log(from / to);
    return a.target * std::pow(b.target / a.target, std::clamp(share, kLeastShare, 1 - kLeastShare));
  }
  double beyond(const Tried& now) {
    if (last && last->target != now.target)
      power = std::clamp(-std::log(odds(now.triangles) / odds(last->triangles)) / std::log(now.target / last->target),
                         kLeastPower, kMostPower);
    const double step = std::pow(odds(now.triangles) / odds(wanted), 1 / power);
    return now.target * std::clamp(step, 1 / kLongestStep, kLongestStep);
  }
};

class Pilot {
 public:
  Pilot(Builder& builder, proto::Plan& plan, const std::atomic<bool>& stop)
      : builder_(builder), plan_(plan), stop_(stop), finest_(static_cast<int>(plan.finest_level())) {}

  proto::Result<void> run() {
    if (const auto chosen = choose_blocks(); !chosen.ok()) return chosen;
    if (!blocks_.empty()) {
      if (const auto searched = search(); !searched.ok()) return searched;
    }
    set_levels_above();
    builder_.use(plan_);
    return {};
  }

 private:
  /// Evenly spread; the rule of position alone keeps it deterministic. Blocks at the data's edge may be empty: from each chosen
  /// place it looks on until one has data.
  proto::Result<void> choose_blocks() {
    const int block_level = static_cast<int>(plan_.block_level());
    const bool by_tiles = strategy_of(plan_) != gpu::kExact;
    const SampleSize size = by_tiles ? kSampleOfTiles : kSample;
    const bool whole = touched_count(plan_, finest_) <= 4.0 * kWholeTiles && touched_tiles(plan_, finest_).size() <= kWholeTiles;
    top_ = whole ? block_level : std::max(block_level, finest_ - size.levels_up);
    const std::vector<proto::TileAddress> all = nodes_to_choose_from();
    const std::size_t wanted = whole ? all.size() : std::min(size.blocks, all.size());
    builder_.use(sampled(), true);
    for (std::size_t k = 0; k < wanted; ++k) {
      for (std::size_t at = k * all.size() / wanted; at < (k + 1) * all.size() / wanted; ++at) {
        auto block = builder_.sample_block(all[at]);
        if (!block.ok()) return block.problem();
        if (stop_) return kCancelled;
        const double triangles = triangles_of_grid(*block);
        if (triangles == 0) continue;
        blocks_.push_back({std::move(*block), triangles});
        break;
      }
    }
    order_by_golden_steps();
    first_ = whole ? blocks_.size() : std::min(size.first, blocks_.size());
    sampled_ = !whole && !by_tiles ? levels_with_triangles() : finest_ - top_ + 1;
    return {};
  }

  /// Of the level of the sample's nodes; of very many one in each node of a coarser level.
  std::vector<proto::TileAddress> nodes_to_choose_from() const {
    constexpr double kMostListed = 1 << 18;
    int listed = top_;
    while (listed > 0 && touched_count(plan_, listed) > kMostListed) --listed;
    std::vector<proto::TileAddress> nodes = touched_tiles(plan_, listed);
    const int down = top_ - listed, middle = down == 0 ? 0 : 1 << (down - 1);
    for (proto::TileAddress& node : nodes) node = {top_, (node.x << down) + middle, (node.y << down) + middle};
    return nodes;
  }

  /// So that the first ones are spread over the data, too.
  void order_by_golden_steps() {
    std::vector<SampleBlock> ordered;
    std::vector<bool> taken(blocks_.size());
    for (std::size_t k = 0; ordered.size() < blocks_.size(); ++k) {
      const std::size_t at = spread_place(k, blocks_.size());
      if (taken[at]) continue;
      taken[at] = true;
      ordered.push_back(std::move(blocks_[at]));
    }
    blocks_ = std::move(ordered);
  }

  double grid_triangles(std::size_t blocks) const {
    double sum = 0;
    for (std::size_t k = 0; k < blocks; ++k) sum += blocks_[k].grid_triangles;
    return sum;
  }

  /// In the mean of the blocks there are enough of them.
  int levels_with_triangles() const {
    const double grid = grid_triangles(blocks_.size()) / static_cast<double>(std::max<std::size_t>(blocks_.size(), 1));
    int levels = 1;
    while (levels < plan_.levels_size() && kept_share(plan_.options(), levels) * grid >= kLeastTriangles) ++levels;
    return levels;
  }

  /// Blocks of the sample; targets and what derives from them stay those of the real ones.
  proto::Plan sampled() const {
    proto::Plan plan = plan_;
    plan.set_block_level(static_cast<std::uint32_t>(top_));
    return plan;
  }

  static double triangles_of_grid(const Builder::SampleBlock& block) {
    const proto::Samples& s = block.samples;
    if (s.all_void()) return 0;
    const auto valid = [&](std::int64_t x, std::int64_t y) {
      return s.height[static_cast<std::size_t>((y - s.south) * s.columns + (x - s.west))] != proto::kNoHeight ? 1 : 0;
    };
    double count = 0;
    for (std::int64_t y = block.place.south; y < block.place.north; ++y)
      for (std::int64_t x = block.place.west; x < block.place.east; ++x)
        count += std::max(valid(x, y) + valid(x + 1, y) + valid(x, y + 1) + valid(x + 1, y + 1) - 2, 0);
    return count;
  }

  proto::Result<void> search() {
    std::vector<SearchedLevel> levels;
    for (int up = 0; up < sampled_; ++up) {
      SearchedLevel level;
      level.close = kClose * std::pow(kLessClose, up);
      level.least = std::ldexp(kLeastError_m, up), level.most = greatest_target_m(plan_, finest_ - up);
      level.target = std::clamp(plan_.levels(up).target(), level.least, level.most);
      levels.push_back(level);
    }
    if (const auto done = search(levels, first_, kMostRunsOfFirst); !done.ok() || first_ == blocks_.size()) return done;
    for (SearchedLevel& level : levels) level.forget_all_but_power();
    return search(levels, blocks_.size(), kMostRunsOfAll);
  }

  /// With so many blocks. The plan has the best targets then, and so have levels.
  proto::Result<void> search(std::vector<SearchedLevel>& levels, std::size_t blocks, int most_runs) {
    const double grid = grid_triangles(blocks);
    for (std::size_t up = 0; up < levels.size(); ++up)
      levels[up].grid = grid, levels[up].wanted = kept_share(plan_.options(), static_cast<int>(up)) * grid;
    double least_off = INFINITY;
    proto::Plan best = plan_;
    for (int run = 0; run < most_runs && least_off > 0; ++run) {
      for (std::size_t up = 0; up < levels.size(); ++up) {
        if (up > 0) levels[up].target = std::clamp(levels[up].target, levels[up - 1].target, levels[up].most);
        set_target(static_cast<int>(up), levels[up].target);
      }
      const auto triangles = count(blocks);
      if (!triangles.ok()) return triangles.problem();
      double off = 0;
      for (std::size_t up = 0; up < levels.size(); ++up) off += levels[up].off((*triangles)[up]);
      if (off < least_off) least_off = off, best = plan_;
      learn(*triangles, levels);
    }
    plan_ = std::move(best);
    for (std::size_t up = 0; up < levels.size(); ++up) levels[up].target = plan_.levels(static_cast<int>(up)).target();
    return {};
  }

  static void learn(const std::vector<double>& triangles, std::vector<SearchedLevel>& levels) {
    bool moved = false;
    for (std::size_t up = 0; up < levels.size(); ++up) {
      const double before = levels[up].target;
      if (moved) levels[up].forget_bounds();
      levels[up].learn(triangles[up]);
      const double step = levels[up].target / before;
      moved = moved || step > kSameBelow || step < 1 / kSameBelow;
    }
  }

  /// Triangles of the sampled levels, from the finest up.
  proto::Result<std::vector<double>> count(std::size_t blocks) {
    builder_.use(sampled(), true);
    std::vector<std::future<proto::Result<std::vector<double>>>> counts;
    for (std::size_t k = 0; k < blocks; ++k)
      counts.push_back(std::async(std::launch::async, [this, k] { return builder_.count(blocks_[k].block, sampled_); }));
    std::vector<double> triangles(static_cast<std::size_t>(sampled_));
    std::optional<proto::Problem> problem;
    for (auto& count : counts) {
      const auto levels = count.get();
      if (!levels.ok())
        problem = levels.problem();
      else
        std::ranges::transform(triangles, *levels, triangles.begin(), std::plus());
    }
    if (problem) return *problem;
    return triangles;
  }

  void set_target(int up, double target_m) {
    proto::LevelPlan& level = *plan_.mutable_levels(up);
    level.set_target(target_m);
    derive_level(plan_, level);
  }

  /// As the last sampled level grew.
  void set_levels_above() {
    const auto target = [&](int up) { return plan_.levels(up).target(); };
    const double growth = sampled_ < 2 ? 2 : std::clamp(target(sampled_ - 1) / target(sampled_ - 2), 1.0, 8.0);
    for (int up = sampled_; up < plan_.levels_size(); ++up)
      set_target(up, std::min(rounded(target(up - 1) * growth), greatest_target_m(plan_, finest_ - up)));
  }

  Builder& builder_;
  proto::Plan& plan_;
  const std::atomic<bool>& stop_;
  const int finest_;
  int top_ = 0;      ///< level of its blocks' nodes
  int sampled_ = 0;  ///< levels, from the finest up
  struct SampleBlock {
    Builder::SampleBlock block;
    double grid_triangles = 0;
  };
  std::vector<SampleBlock> blocks_;
  std::size_t first_ = 0;  ///< so many are searched before all
};

}  // namespace

double kept_share(const proto::BuildOptions& options, int levels_up) {
  const int n = options.keep_size();
  if (levels_up < n) return options.keep(levels_up);
  const double last = options.keep(n - 1), ratio = n > 1 ? last / options.keep(n - 2) : last;
  return last * std::pow(ratio, levels_up - (n - 1));
}

proto::Result<void> run_pilot(Builder& builder, proto::Plan& plan, const std::atomic<bool>& stop) {
  return Pilot(builder, plan, stop).run();
}

}  // namespace cordillera::pipeline
