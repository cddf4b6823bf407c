#include "gpu/exact/side_chain.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "gpu/exact/steps/window.h"

namespace cordillera::gpu::exact {
namespace {

constexpr int kRows = SideSamples::kRows;
/// Of the tolerance, for chords: what is left lets the waves beside the side work.
constexpr double kChordShare = 0.9;
/// Samples; at a block's corner, where the rows within are shorter, fewer. Rows 1 to 3 have a vertex for eight of the next one: 8
/// * 8 * 8 * 4.
constexpr int kLongestChord = 2048, kLongestAtEnds = 512;
/// Of the row beside a side; a chord that sways by more would turn over what lies between.
constexpr double kMostSway = 1.0 / 4;

std::int32_t rounded(double height, std::int32_t step) { return static_cast<std::int32_t>(std::rint(height / step)) * step; }

class Coarsening {
 public:
  Coarsening(const SideSamples& samples, const SideChain& finer, const LevelRules& rules)
      : samples_(samples),
        place_(finer.place),
        height_(finer.height),
        rules_(rules),
        step_(static_cast<std::int32_t>(rules.height_step)),
        longest_(samples.sway > 0 ? static_cast<int>(std::min<double>(kLongestChord, std::sqrt(kMostSway / samples.sway)))
                                  : kLongestChord) {
    const double tolerance = rules.tolerance, side = kChordShare * tolerance - 2;
    // Heights of vertices that rows 1 to 3 get later are rounded on their chords.
    for (int r = 0; r < kRows; ++r)
      tolerance_[static_cast<std::size_t>(r)] = r == kSideReach ? side : std::min(side, tolerance - 2 - 0.5 * step_);
    const auto n = static_cast<int>(place_.size());
    for (int i = 0; i < n; ++i) {
      before_.push_back(i - 1);
      after_.push_back(i + 1);
    }
    version_.assign(place_.size(), 0);
    gone_.assign(place_.size(), 0);
    for (int r = 0; r < kRows; ++r) {
      for (int i = 0; i < n; ++i) height(r, i) = samples_.is_void(r, at(i)) ? 0 : rounded(height(r, i), step_);
    }
  }

  SideChain run() {
    thin();
    for (int r = 0; r < kRows; ++r) fit_heights(r);
    thin();
    SideChain kept;
    for (int i = 0; i < count(); i = after(i)) {
      kept.place.push_back(at(i));
      for (int r = 0; r < kRows; ++r) kept.height[static_cast<std::size_t>(r)].push_back(height(r, i));
    }
    return kept;
  }

 private:
  struct Candidate {
    double cost;
    std::uint32_t order;
    int i;
    unsigned version;
    bool operator<(const Candidate& other) const {  // the greatest of a queue is the one to go
      if (cost != other.cost) return cost > other.cost;
      return order != other.order ? order > other.order : i > other.i;
    }
  };

  int count() const { return static_cast<int>(place_.size()); }
  int at(int i) const { return place_[static_cast<std::size_t>(i)]; }
  int& before(int i) { return before_[static_cast<std::size_t>(i)]; }
  int& after(int i) { return after_[static_cast<std::size_t>(i)]; }
  std::int32_t& height(int r, int i) { return height_[static_cast<std::size_t>(r)][static_cast<std::size_t>(i)]; }
  double tolerance(int r) const { return tolerance_[static_cast<std::size_t>(r)]; }
  bool stays(int i) const {
    if (i == 0 || i == count() - 1 || ((samples_.lattice + at(i)) & (rules_.tile_side - 1)) == 0) return true;
    const auto at_row = static_cast<std::size_t>(at(i));
    if (!samples_.meridian.empty() && stays_on_meridian(samples_.meridian[at_row].to_pole, rules_.tile_side)) return true;
    return ((samples_.lattice + at(i)) & (std::max(rules_.tile_side / kVoidChords, 1) - 1)) == 0 && is_empty(at(i));
  }

  /// What a chord from a to b is lower at s than a line of the lattice, as a height.
  double sag(int a, int s, int b) const { return -samples_.bend * (static_cast<double>(s - a) * (b - s)); }
  /// The farthest sample from the chord from a to b with these heights; more than the limit: no more than that is said.
  double off_chord(int r, int a, double height_a, int b, double height_b, double limit) const {
    const double rise = (height_b - height_a) / (b - a);
    double worst = 0;
    for (int s = a + 1; s < b && worst <= limit; ++s)
      worst = std::max(worst, std::abs(height_a + rise * (s - a) + sag(a, s, b) - samples_.height(r, s)));
    return worst;
  }
  /// Of a row's samples from a to b.
  enum class Kind { valid, empty, mixed };
  Kind kind(int r, int a, int b) const {
    const bool is_void = samples_.is_void(r, a);
    for (int s = a + 1; s <= b; ++s) {
      if (samples_.is_void(r, s) != is_void) return Kind::mixed;
    }
    return is_void ? Kind::empty : Kind::valid;
  }
  bool is_empty(int s) const {
    for (int r = 0; r < kRows; ++r) {
      if (!samples_.is_void(r, s)) return false;
    }
    return true;
  }
  /// What the chord from vertex i to vertex j is off, as a share of what is allowed; above 1: it must not be.
  double share(int i, int j) {
    const int a = at(i), b = at(j);
    if (b - a > (i == 0 || j == count() - 1 ? std::min(kLongestAtEnds, longest_) : longest_)) return 2;
    for (int r = 0; r < kRows; ++r) {
      if (kind(r, a, b) == Kind::mixed) return 2;
    }
    double worst = 0;
    for (int r = 0; r < kRows && worst <= 1; ++r) {
      if (samples_.is_void(r, a)) continue;
      if (!(tolerance(r) > 0)) return 2;
      worst = std::max(worst, off_chord(r, a, height(r, i), b, height(r, j), tolerance(r)) / tolerance(r));
    }
    return worst;
  }
  void offer(int i) {
    if (stays(i)) return;
    const unsigned version = ++version_[static_cast<std::size_t>(i)];
    const double cost = share(before(i), after(i));
    if (cost <= 1) queue_.push({cost, hash32(static_cast<std::uint32_t>(at(i))), i, version});
  }
  /// Vertices leave in the order of what their chord would be off, as long as it is allowed.
  void thin() {
    for (int i = 0; i < count(); ++i) {
      if (!gone_[static_cast<std::size_t>(i)]) offer(i);
    }
    for (; !queue_.empty();) {
      const Candidate next = queue_.top();
      queue_.pop();
      if (gone_[static_cast<std::size_t>(next.i)] || next.version != version_[static_cast<std::size_t>(next.i)]) continue;
      gone_[static_cast<std::size_t>(next.i)] = 1;
      const int a = before(next.i), b = after(next.i);
      after(a) = b;
      before(b) = a;
      offer(a);
      offer(b);
    }
  }
  /// Every vertex of a row to the least squares of the samples on its two chords, if all stay within; else half-way, else not.
  void fit_heights(int r) {
    if (samples_.on_pole && r == kSideReach) return;
    for (int i = after(0); i < count() - 1; i = after(i)) {
      const int a = before(i), b = after(i);
      if (!(tolerance(r) > 0) || kind(r, at(a), at(b)) != Kind::valid) continue;
      double sum = 0, weights = 0;
      for (int s = at(a) + 1; s < at(b); ++s) {
        const int end = s <= at(i) ? a : b;
        const double near = static_cast<double>(s - at(end)) / (at(i) - at(end));
        const double chord =
            height(r, end) * (1 - near) + height(r, i) * near + (end == a ? sag(at(a), s, at(i)) : sag(at(i), s, at(b)));
        sum += near * (samples_.height(r, s) - chord);
        weights += near * near;
      }
      std::int32_t moved = rounded(height(r, i) + sum / weights, step_);
      for (int attempt = 0; attempt < 2 && moved != height(r, i); ++attempt) {
        if (holds(r, i, moved))
          height(r, i) = moved;
        else
          moved = rounded(0.5 * (moved + static_cast<double>(height(r, i))), step_);
      }
    }
  }
  bool holds(int r, int i, std::int32_t moved) {
    const int a = before(i), b = after(i);
    return std::abs(static_cast<double>(moved) - samples_.height(r, at(i))) <= tolerance(r) &&
           off_chord(r, at(a), height(r, a), at(i), moved, tolerance(r)) <= tolerance(r) &&
           off_chord(r, at(i), moved, at(b), height(r, b), tolerance(r)) <= tolerance(r);
  }

  const SideSamples& samples_;
  std::vector<int> place_, before_, after_;
  std::array<std::vector<std::int32_t>, kRows> height_;
  const LevelRules rules_;
  const std::int32_t step_;
  const int longest_;  ///< of chords
  std::array<double, kRows> tolerance_{};
  std::vector<unsigned> version_;
  std::vector<std::uint8_t> gone_;
  std::priority_queue<Candidate> queue_;
};

}  // namespace

std::int32_t SideChain::height_at(int r, int s, double bend, std::int32_t step) const {
  const std::vector<std::int32_t>& heights = height[static_cast<std::size_t>(r)];
  const auto b = static_cast<std::size_t>(
                 std::max<std::ptrdiff_t>(1, std::lower_bound(place.begin(), place.end(), s) - place.begin())),
             a = b - 1;
  if (place[b] == s) return heights[b];
  if (place[a] == s) return heights[a];
  const double sag = -bend * (static_cast<double>(s - place[a]) * (place[b] - s));
  return rounded(heights[a] + (static_cast<double>(heights[b]) - heights[a]) * (s - place[a]) / (place[b] - place[a]) + sag,
                 step);
}

SideChain finest_chain(const SideSamples& samples) {
  SideChain chain;
  for (int s = 0; s <= samples.length(); ++s) {
    chain.place.push_back(s);
    for (int r = 0; r < kRows; ++r)
      chain.height[static_cast<std::size_t>(r)].push_back(samples.is_void(r, s) ? 0 : samples.height(r, s));
  }
  return chain;
}

SideChain coarser_chain(const SideSamples& samples, const SideChain& finer, const LevelRules& rules) {
  return Coarsening(samples, finer, rules).run();
}

}  // namespace cordillera::gpu::exact
