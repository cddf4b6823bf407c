#pragma once
// Which candidates collapse in a wave. A vertex speaks for the edges to neighbours of higher number; the cheapest is its
// candidate. Of the candidates under a threshold those win that are the least around both their ends.
#include "gpu/fit/edge_rules.h"
#include "gpu/fit/wave_view.h"

namespace cordillera::gpu::fit {

struct IsStaleUnder {
  WaveView wave;
  std::uint32_t most_class;
  CORDILLERA_HD bool operator()(std::uint32_t v) const {
    return (wave.mark[v] & kStale) && wave.cost[v] < kNever && cost_class(wave.cost[v]) <= most_class;
  }
};

struct IsCandidateUnder {
  WaveView wave;
  std::uint32_t most_class;
  CORDILLERA_HD bool operator()(std::uint32_t v) const {
    return !(wave.mark[v] & kStale) && wave.cost[v] < kNever && cost_class(wave.cost[v]) <= most_class;
  }
};

/// A candidate edge, by its two ends; side by side in memory, for every round looks at all of them.
struct Bid {
  std::uint32_t u, v;
  std::uint64_t key;  ///< class of cost over a hash of its place: no two are equal
};
inline constexpr std::uint64_t kNoBid = ~std::uint64_t{0};

CORDILLERA_HD inline std::uint64_t bid_key(const MeshView& mesh, const WaveView& wave, std::uint32_t u) {
  const std::uint32_t edge = (u << mesh.row_shift) + wave.intent[u].slot;
  return (std::uint64_t{ordered(wave.cost[u]) >> 16} << 32) | mixed(edge);
}

struct MakeBid {
  MeshView mesh;
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
  MeshView mesh;
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
    if (!all_around(bid, [&](std::uint32_t x) { return wave.lock[x] >= mine; })) return;
    bid.key = kNoBid;
    const Intent& intent = wave.intent[bid.u];
    if (ask_again && !(valences_allow(mesh, bid.u, intent.slot) && link_sees(mesh, bid.u, bid.v, intent.at))) {
      wave.mark[bid.u] |= kStale;
      return;
    }
    wave.mark[bid.u] |= kWinner;
    all_around(bid, [&](std::uint32_t x) {
      wave.spent[x] = wave_number;
      return true;
    });
  }

 private:
  template <class Visit>
  CORDILLERA_HD bool all_around(const Bid& bid, const Visit& visit) const {
    for (int end = 0; end < 2; ++end) {
      const std::uint32_t from = end ? bid.v : bid.u, valence = mesh.vertex[from].valence;
      const std::uint32_t* const row = mesh.row(from);
      for (std::uint32_t i = 0; i < valence; ++i) {
        if (!visit(row[i])) return false;
      }
    }
    return true;
  }
};

struct IsWinner {
  WaveView wave;
  const std::uint32_t* list;
  CORDILLERA_HD bool operator()(std::uint32_t i) const { return (wave.mark[list[i]] & kWinner) != 0; }
};

CORDILLERA_HD inline bool is_border_edge(const MeshView& mesh, std::uint32_t u, std::uint32_t slot) {
  return mesh.vertex[u].open() && mesh.vertex[mesh.row(u)[slot]].open();
}

/// Winners on the border: they take one triangle, not two.
struct CountBorder {
  MeshView mesh;
  WaveView wave;
  const std::uint32_t* list;
  std::uint32_t* count;
  CORDILLERA_HD void operator()(std::size_t i) const {
    if (is_border_edge(mesh, list[i], wave.intent[list[i]].slot)) fetch_add(count, 1);
  }
};

struct DescribeWinner {
  MeshView mesh;
  WaveView wave;
  const std::uint32_t* list;
  std::uint64_t* keys;
  std::uint32_t* removal;
  CORDILLERA_HD void operator()(std::size_t i) const {
    keys[i] = bid_key(mesh, wave, list[i]);
    removal[i] = is_border_edge(mesh, list[i], wave.intent[list[i]].slot) ? 1 : 2;
  }
};

struct ForgetWinner {
  WaveView wave;
  const std::uint32_t* list;
  CORDILLERA_HD void operator()(std::size_t i) const { wave.mark[list[i]] &= static_cast<std::uint8_t>(~kWinner); }
};

struct ForgetRounds {
  WaveView wave;
  CORDILLERA_HD void operator()(std::size_t v) const {
    wave.spent[v] = 0;
    wave.lock[v] = ~std::uint64_t{0};
  }
};

}  // namespace cordillera::gpu::fit
