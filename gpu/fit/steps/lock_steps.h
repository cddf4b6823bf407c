#pragma once
// Which candidates collapse in a wave. A vertex speaks for the edges to neighbours of higher number; the cheapest is its
// candidate. Of the candidates under a threshold those win that are the least around both their ends.
#include "gpu/device/bits.h"
#include "gpu/fit/steps/edge_rules.h"
#include "gpu/fit/steps/progress.h"
#include "gpu/fit/steps/steps.h"

namespace cordillera::gpu::fit {

struct IsStaleUnder {
  WaveView wave;
  Count most_class;
  CORDILLERA_HD bool operator()(std::uint32_t v) const {
    return (wave.mark[v] & kStale) && wave.cost[v] < kNever && cost_class(wave.cost[v]) <= most_class.value();
  }
};

struct IsCandidateUnder {
  WaveView wave;
  Count most_class;
  CORDILLERA_HD bool operator()(std::uint32_t v) const {
    return !(wave.mark[v] & kStale) && wave.cost[v] < kNever && cost_class(wave.cost[v]) <= most_class.value();
  }
};

/// A candidate edge, by its two ends; side by side in memory, for every round looks at all of them.
struct Bid {
  std::uint32_t u, v;
  std::uint64_t key;  ///< class of cost over a hash of its place: no two are equal
};
inline constexpr std::uint64_t kNoBid = ~std::uint64_t{0};

CORDILLERA_HD inline std::uint64_t bid_key(const FitMesh& mesh, const WaveView& wave, std::uint32_t u) {
  const std::uint32_t edge = (u << mesh.row_shift) + wave.intent[u].slot;
  return (std::uint64_t{ordered(wave.cost[u]) >> 16} << 32) | hash32(edge);
}

struct MakeBid {
  FitMesh mesh;
  WaveView wave;
  const std::uint32_t* list;
  Bid* bids;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t u = list[i];
    bids[i] = {u, mesh.row(u)[wave.intent[u].slot], bid_key(mesh, wave, u)};
  }
};

/// Locks of one round. Round numbers grow; what an earlier round left loses against all of a later one.
struct Lock {
  FitMesh mesh;
  WaveView wave;
  Bid* bids;
  std::uint32_t round;  ///< < 2^16
  std::uint32_t wave_number;

  CORDILLERA_HD std::uint64_t key(const Bid& bid) const { return (std::uint64_t{0xffffu - round} << 48) | bid.key; }
};

/// A candidate whose triangles no winner of this wave has taken offers its key to both ends.
struct Offer : Lock {
  CORDILLERA_HD void operator()(std::size_t i) const {
    Bid& bid = bids[i];
    if (bid.key == kNoBid) return;
    if (wave.spent[bid.u] == wave_number || wave.spent[bid.v] == wave_number) {
      bid.key = kNoBid;
      return;
    }
    lower_to(wave.lock + bid.u, key(bid));
    lower_to(wave.lock + bid.v, key(bid));
  }
};

/// The least around both its ends wins. Where planes are carried, costs last longer than what they were allowed by: that is asked
/// again.
struct Decide : Lock {
  bool ask_again;

  CORDILLERA_HD void operator()(std::size_t i) const {
    Bid& bid = bids[i];
    if (bid.key == kNoBid) return;
    const std::uint64_t mine = key(bid);
    if (wave.lock[bid.u] != mine || wave.lock[bid.v] != mine) return;
    if (!is_least_around(bid.u, mine) || !is_least_around(bid.v, mine)) return;
    bid.key = kNoBid;
    const Intent& intent = wave.intent[bid.u];
    if (ask_again && !(valences_allow(mesh, bid.u, intent.slot) && link_sees(mesh, bid.u, bid.v, intent.at))) {
      wave.mark[bid.u] |= kStale;
      return;
    }
    wave.mark[bid.u] |= kWinner;
    spend_around(bid.u);
    spend_around(bid.v);
  }

 private:
  /// Several at once: each is far away in memory.
  CORDILLERA_HD bool is_least_around(std::uint32_t end, std::uint64_t mine) const {
    const std::uint32_t valence = mesh.vertex[end].valence;
    const std::uint32_t* const row = mesh.row(end);
    for (std::uint32_t i = 0; i < valence; i += kAtOnce) {
      bool least = true;
      for (std::uint32_t k = 0; k < kAtOnce; ++k) least &= wave.lock[row[i + k < valence ? i + k : 0]] >= mine;
      if (!least) return false;
    }
    return true;
  }
  CORDILLERA_HD void spend_around(std::uint32_t end) const {
    const std::uint32_t* const row = mesh.row(end);
    for (std::uint32_t i = 0; i < mesh.vertex[end].valence; ++i) set_shared(wave.spent + row[i], wave_number);
  }
};

struct IsWinner {
  WaveView wave;
  CORDILLERA_HD bool operator()(std::uint32_t v) const { return (wave.mark[v] & kWinner) != 0; }
};
struct ForgetWinner {
  WaveView wave;
  CORDILLERA_HD void operator()(std::uint32_t v) const { wave.mark[v] &= static_cast<std::uint8_t>(~kWinner); }
};

/// Along the border: such an edge takes one triangle, not two.
struct IsAlongBorder {
  FitMesh mesh;
  WaveView wave;
  CORDILLERA_HD bool operator()(std::uint32_t u) const {
    return mesh.vertex[u].open() && mesh.vertex[mesh.row(u)[wave.intent[u].slot]].open();
  }
};

/// What a wave may do: whole, or nothing and the series halts.
struct CommitCollapses {
  Progress* progress;
  Count winners, along_border;
  bool anyone;  ///< all were candidates from the first

  CORDILLERA_HD void operator()(std::size_t) const {
    Progress& at = *progress;
    at.going = 0;
    if (at.halt != Halt::none) return;
    at.winners = winners.value();
    const std::uint32_t removed = 2 * at.winners - along_border.value();
    if (at.winners == 0 && (anyone || at.all)) {
      at.halt = Halt::stuck;
    } else if (removed > at.triangles - at.least) {
      at.halt = Halt::cut;
    } else {
      at.all = at.winners == 0;
      at.go(at.winners, removed);
    }
  }
};

struct ForgetRounds {
  WaveView wave;
  CORDILLERA_HD void operator()(std::size_t v) const {
    wave.spent[v] = 0;
    wave.lock[v] = ~std::uint64_t{0};
  }
};

}  // namespace cordillera::gpu::fit
