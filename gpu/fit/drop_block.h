#pragma once
// The waves of drops inside a block: a run of vertex numbers that lie near each other in the plan, few enough for a cache. Blocks
// know nothing of each other: a vertex that has a neighbour outside its own waits. So one team works off all waves of a block
// before the next, and several teams need no talk.
#include "gpu/fit/steps/drop_steps.h"

namespace cordillera::gpu::fit {

struct BlockSchedule {
  int waves = 10;
  Count first_class;               ///< up to this cost vertices may go in the first wave
  std::uint32_t class_growth = 0;  ///< a wave
  double most_share = 1;           ///< of a block's vertices may go
};

struct DropInBlock {
  FitMesh mesh;
  WaveView wave;
  BlockSchedule schedule;
  const std::uint32_t* start;  ///< indexed by block, one more at the end
  std::uint32_t* dropped;      ///< likewise; zeroed

  template <class Team>
  CORDILLERA_HD void operator()(Team& team, std::size_t block) const {
    const Range range{start[block], start[block + 1]};
    const auto most = static_cast<std::uint32_t>(schedule.most_share * (range.end - range.begin));
    team.each(range.size(), [&](std::size_t i) { lock(range, range.at(i)); });
    team.barrier();
    std::uint32_t limit = schedule.first_class.value();
    for (int k = 0; k < schedule.waves; ++k, limit += schedule.class_growth) {
      const auto number = static_cast<std::uint32_t>(k + 1);
      team.each(range.size(), [&](std::size_t i) { evaluate(range, range.at(i), limit); });
      team.barrier();
      if (!drop(team, range, {limit, number, most}, dropped + block)) break;
      team.each(range.size(), [&](std::size_t i) {
        if (wave.spent[range.at(i)] == number) CloseRing{mesh, wave}(range.at(i));
      });
      team.barrier();
    }
  }

 private:
  struct Range {
    std::uint32_t begin, end;
    CORDILLERA_HD std::size_t size() const { return end - begin; }
    CORDILLERA_HD std::uint32_t at(std::size_t i) const { return begin + static_cast<std::uint32_t>(i); }
    CORDILLERA_HD bool holds(std::uint32_t v) const { return v >= begin && v < end; }
  };
  struct Limits {
    std::uint32_t most_class, wave_number, most_dropped;
  };

  CORDILLERA_HD bool is_inside(Range range, std::uint32_t v) const {
    const std::uint32_t* const row = mesh.row(v);
    for (std::uint32_t i = 0; i < mesh.vertex[v].valence; ++i) {
      if (!range.holds(row[i])) return false;
    }
    return true;
  }
  CORDILLERA_HD void lock(Range range, std::uint32_t v) const {
    if (!is_inside(range, v)) wave.cost[v] = kNever;
  }
  CORDILLERA_HD void evaluate(Range range, std::uint32_t v, std::uint32_t limit) const {
    if (!IsStaleUnder{wave, limit}(v)) return;
    if (is_inside(range, v)) return EvaluateDrop{mesh, wave}(v);
    wave.cost[v] = kNever;
    wave.mark[v] = 0;
  }
  /// False: more would go than may.
  template <class Team>
  CORDILLERA_HD bool drop(Team& team, Range range, Limits limits, std::uint32_t* count) const {
    team.each(range.size(), [&](std::size_t i) {
      const std::uint32_t v = range.at(i);
      if (IsCandidateUnder{wave, limits.most_class}(v) && IsLeast{mesh, wave, limits.most_class}(v)) MarkPossible{mesh, wave}(v);
    });
    team.barrier();
    team.each(range.size(), [&](std::size_t i) {
      const std::uint32_t v = range.at(i);
      if (!IsFirstSuitor{mesh, wave, range.begin, range.end}(v)) return;
      wave.mark[v] |= kTouched;
      fetch_add(count, 1);
    });
    team.barrier();
    const bool go_on = *count <= limits.most_dropped;
    team.each(range.size(), [&](std::size_t i) {
      const std::uint32_t v = range.at(i);
      if (!(wave.mark[v] & kWinner)) return;
      const bool first = (wave.mark[v] & kTouched) != 0;
      wave.mark[v] = 0;
      if (first && go_on) Drop{mesh, wave, limits.wave_number}(v);
    });
    team.barrier();
    return go_on;
  }
};

/// Those that had to wait for a neighbour outside their block.
struct Unlock {
  FitMesh mesh;
  WaveView wave;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto v = static_cast<std::uint32_t>(i);
    if (mesh.vertex[v].gone() || wave.cost[v] < kNever) return;
    wave.cost[v] = -kNever;
    wave.mark[v] = kStale;
  }
};

}  // namespace cordillera::gpu::fit
