#pragma once
// Waves are given out without waiting for what became of those before: how they stand is kept where they run. A wave that may not
// go on as it is halts the series, and what was given out after it finds nothing to do.
#include "gpu/fit/steps/wave_view.h"

namespace cordillera::gpu::fit {

enum class Halt : std::uint32_t {
  none,
  enough,    ///< there are few triangles enough
  cut,       ///< the winners of the last wave are too many
  close_up,  ///< many numbers belong to vertices that are gone
  stuck,     ///< nothing can go
};

struct Progress {
  std::uint64_t triangles = 0;
  std::uint64_t enough = 0;  ///< few enough
  std::uint64_t least = 0;   ///< and too few, if fewer
  std::uint32_t vertices = 0;
  std::uint32_t crowded = 0;  ///< with so many vertices left, numbers are closed up
  std::uint32_t winners = 0;  ///< of the last wave
  std::uint32_t going = 0;    ///< those of them that may go
  std::uint32_t limit = 0;    ///< candidates have costs up to this class
  std::uint32_t all = 0;      ///< 1: all vertices are candidates
  Halt halt = Halt::none;

  CORDILLERA_HD void go(std::uint32_t count, std::uint32_t removed) {
    going = count;
    vertices -= count;
    triangles -= removed;
    halt = triangles <= enough ? Halt::enough : vertices <= crowded ? Halt::close_up : Halt::none;
  }
};

/// Indexed by class, zeroed: how many vertices have a cost in it.
struct CostBins {
  static constexpr std::size_t kParts = 64, kPart = kCostClasses / kParts;
  std::uint32_t* count;
  std::uint32_t* sums;  ///< of parts of the classes

  /// The class up to which so many lie; empties the bins. wanted(all) says how many.
  template <class Team, class Wanted, class Take>
  CORDILLERA_HD void find(Team& team, const Wanted& wanted, const Take& take) const {
    team.each(kParts, [&](std::size_t part) { sums[part] = sum_of(count + part * kPart, kPart); });
    team.barrier();
    team.each(1, [&](std::size_t) {
      std::uint32_t left = wanted(sum_of(sums, kParts));
      const std::uint32_t part = reach(sums, kParts, left);
      take(static_cast<std::uint32_t>(part * kPart) + (part < kParts ? reach(count + part * kPart, kPart, left) : 0));
    });
    team.barrier();
    team.each(kCostClasses, [&](std::size_t k) { count[k] = 0; });
  }

 private:
  CORDILLERA_HD static std::uint32_t sum_of(const std::uint32_t* values, std::size_t n) {
    std::uint32_t sum = 0;
    for (std::size_t k = 0; k < n; ++k) sum += values[k];
    return sum;
  }
  /// The first with which the sum is as much as is left; takes those before it off.
  CORDILLERA_HD static std::uint32_t reach(const std::uint32_t* values, std::size_t n, std::uint32_t& left) {
    std::uint32_t below = 0, place = 0, before = 0;
    for (std::size_t k = 0; k < n; ++k) {
      below += values[k];
      if (below >= left) continue;
      before = below;
      place = static_cast<std::uint32_t>(k) + 1;
    }
    left -= before;
    return place;
  }
};

}  // namespace cordillera::gpu::fit
