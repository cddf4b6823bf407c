#pragma once
// A window's life: loaded from the mesh, simplified in waves, stored back. A Team is a block of threads with barriers, or one
// host thread with plain loops:
//   each(n, f)                     f(i) for i in 0..n-1
//   sync()
//   place(counter)                 adds one; what it was before
//   each_open(w, n, f)             f(u) for every u in 0..n-1 that is neither clean nor dead
//   evaluate(w, n)                 the first n vertices of the list to_evaluate
//   measure(w, field, n, work)     work.fail(i) for every i in 0..n-1 of whose triangles one does not fit
//   pull(w, field, n, work)        adds up the pulls of every i into w.pull and w.pull_weight of its vertex
// Before measure and pull, and after them, all threads have met.
#include "gpu/exact/steps/collapse.h"
#include "gpu/exact/steps/heights.h"

namespace cordillera::gpu::exact {

/// What the windows of a pass share. Windows are ranges of `order`.
struct PassView {
  MeshView mesh;
  const BlockView* blocks = nullptr;
  std::uint32_t* window = nullptr;          ///< indexed by vertex
  std::uint16_t* local = nullptr;           ///< indexed by vertex: its place in its window
  const std::uint32_t* order = nullptr;     ///< vertices by window
  const std::uint32_t* first = nullptr;     ///< indexed by window, into order; one more at the end
  const std::uint32_t* block_of = nullptr;  ///< indexed by window
  LevelRules rules;
  int idle_share = 0;  ///< waves end when fewer than one vertex in so many goes; 0: when none does
  int height_rounds = 0;
  bool rest = false;  ///< windows that are all settled are left as they are
};

inline constexpr int kMostWaves = 200, kLeastWaves = 5;

struct LoadVertex {
  const PassView& pass;
  const BlockView& block;
  const WindowView& w;
  std::uint32_t number;

  CORDILLERA_HD bool load_ring(int i, std::uint32_t v) const {
    const std::uint32_t* const ring = pass.mesh.ring_of(v);
    bool outside = false;
    for (int k = 0; k < pass.mesh.valence[v]; ++k) {
      const bool inside = pass.window[ring[k]] == number;
      w.entry(i, k) = inside ? pass.local[ring[k]] : static_cast<std::uint16_t>(kOutside | k);
      outside = outside || !inside;
    }
    return outside;
  }
  CORDILLERA_HD std::uint8_t lines_at(int x, int y) const {
    const bool upright = x == block.west || x == block.east, level = y == block.south || y == block.north;
    const int mask = pass.rules.tile_side - 1;
    std::uint8_t flag = (upright || level) ? kOpenFan : 0;
    if (upright || ((block.lattice_x + x) & mask) == 0) flag |= kOnUpright;
    if (level || ((block.lattice_y + y) & mask) == 0) flag |= kOnLevel;
    if ((upright && level) || block.is_where_cuts_meet(x, y)) flag |= kBlockCorner;
    if (block.is_on_cut(x, y)) flag |= kHeldSide;
    return flag;
  }
  CORDILLERA_HD void operator()(int i) const {
    const std::uint32_t v = (pass.order + pass.first[number])[i];
    const std::uint8_t mark = pass.mesh.mark[v];
    const std::uint32_t position = pass.mesh.position[v];
    const int x = position_x(position), y = position_y(position);
    const std::uint8_t lines = lines_at(x, y);
    const bool outside = load_ring(i, v),
               on_meridian = (lines & kOnUpright) && stays_on_meridian(w.curve.at(y).to_pole, pass.rules.tile_side);
    const bool stays = block.keeps_sides && block.is_on_held_side(x, y);
    const bool locked = outside || (mark & kHeld) || on_meridian || stays;
    w.position(i) = position;
    w.height(i) = pass.mesh.height[v];
    w.truth(i) = block.field.height_at(x, y);
    w.valence(i) = pass.mesh.valence[v];
    w.tried(i) = locked ? 1 : 0;  // 0 later: its ring has changed
    w.target(i) = 0;
    w.key(i) = kNever;
    w.flag(i) = static_cast<std::uint8_t>(lines | (locked ? kLocked : 0) | ((mark & kVoidVertex) ? kVoidHere : 0));
    w.state(i) = locked || (mark & kSettled) ? kClean : kStale;
  }
};

struct StoreVertex {
  const PassView& pass;
  const WindowView& w;
  const std::uint32_t* order;

  CORDILLERA_HD void operator()(int i) const {
    const std::uint32_t v = order[i];
    const MeshView& mesh = pass.mesh;
    if (w.state(i) == kDead) {
      mesh.valence[v] = 0;
      return;
    }
    std::uint32_t* const ring = mesh.ring_of(v);
    const bool locked = (w.flag(i) & kLocked) != 0;
    std::uint32_t before[kRingWidth];
    if (locked) {
      for (int k = 0; k < mesh.valence[v]; ++k) before[k] = ring[k];
    }
    for (int k = 0; k < w.valence(i); ++k) {
      const int other = w.entry(i, k);
      ring[k] = (other & kOutside) ? before[other & ~kOutside] : order[other];
    }
    mesh.height[v] = w.height(i);
    mesh.valence[v] = w.valence(i);
    const bool settled = locked ? (mesh.mark[v] & kSettled) && w.tried(i) != 0 : w.state(i) == kClean && w.key(i) == kNever;
    mesh.mark[v] = static_cast<std::uint8_t>((mesh.mark[v] & ~kSettled) | (settled ? kSettled : 0));
  }
};

template <class Team>
class WindowPass {
 public:
  CORDILLERA_HD WindowPass(Team& team, const PassView& pass, std::uint32_t number, unsigned char* storage)
      : team_(team),
        pass_(pass),
        block_(pass.blocks[pass.block_of[number]]),
        number_(number),
        order_(pass.order + pass.first[number]),
        count_(static_cast<int>(pass.first[number + 1] - pass.first[number])),
        w_{storage, pass.rules.of(block_), block_.field.curve} {}

  CORDILLERA_HD void run() {
    load();
    list_stale();
    if (pass_.rest && w_.counter(kToEvaluate) == 0) return;
    waves();
    for (int round = 0; round < pass_.height_rounds; ++round) {
      move_heights(round);
      list_stale();
      waves();
    }
    team_.each(count_, StoreVertex{pass_, w_, order_});
  }

 private:
  CORDILLERA_HD void load() {
    const PassView& pass = pass_;
    const std::uint32_t* const order = order_;
    team_.each(count_, [&pass, order](int i) { pass.local[order[i]] = static_cast<std::uint16_t>(i); });
    clear(0, kCounters);
    team_.sync();
    team_.each(count_, LoadVertex{pass_, block_, w_, number_});
    team_.sync();
  }
  CORDILLERA_HD void clear(int from, int count) {
    const WindowView& w = w_;
    team_.each(count, [&w, from](int i) { w.counter(from + i) = 0; });
  }
  CORDILLERA_HD void list_stale() {
    const WindowView& w = w_;
    Team& team = team_;
    team_.each_open(w, count_, [&w, &team](int u) {
      if (w.state(u) == kStale) w.to_evaluate(team.place(&w.counter(kToEvaluate))) = static_cast<std::uint16_t>(u);
    });
    team_.sync();
  }
  CORDILLERA_HD void list_winners() {
    const WindowView& w = w_;
    Team& team = team_;
    team_.each_open(w, count_, [&w, &team](int u) {
      if (wins(w, u)) w.winner(team.place(&w.counter(kWinners))) = static_cast<std::uint16_t>(u);
    });
  }
  CORDILLERA_HD void list_changed() {
    const WindowView& w = w_;
    Team& team = team_;
    team_.each_open(w, count_, [&w, &team](int u) {
      const std::uint8_t state = w.state(u);
      if (state == kTouched) w.to_gather(team.place(&w.counter(kToGather))) = static_cast<std::uint16_t>(u);
      if (state == kTouched || state == kStale)
        w.to_evaluate(team.place(&w.counter(kToEvaluate))) = static_cast<std::uint16_t>(u);
    });
  }
  /// The order within a list does not matter: all choices are by key.
  CORDILLERA_HD void waves() {
    const WindowView& w = w_;
    for (int wave = 0; wave < kMostWaves; ++wave) {
      team_.evaluate(w, w.counter(kToEvaluate));
      team_.sync();
      list_winners();
      clear(kToEvaluate, 1);
      team_.sync();
      const int winners = w.counter(kWinners);
      team_.measure(w, block_.field, winners, AfterCollapse{w});
      team_.each(winners, [&w](int i) { commit_collapse(w, w.winner(i)); });
      team_.sync();
      list_changed();
      team_.sync();
      const int left = w.counter(kToEvaluate);
      team_.each(w.counter(kToGather), [&w](int i) { gather(w, w.to_gather(i)); });
      team_.sync();
      clear(kWinners, 2);
      if (left == 0 || (wave >= kLeastWaves && winners * pass_.idle_share < count_ && pass_.idle_share > 0)) break;
    }
    clear(kToEvaluate, 1);
    team_.sync();
  }
  CORDILLERA_HD void move_heights(int round) {
    const WindowView& w = w_;
    Team& team = team_;
    team_.each(count_, [&w, round](int u) { queue_height(w, u, round); });
    team_.sync();
    team_.each(count_, [&w, &team](int u) {
      if (moves_first(w, u)) w.to_gather(team.place(&w.counter(kToGather))) = static_cast<std::uint16_t>(u);
    });
    team_.sync();
    while (const int movers = w.counter(kToGather)) {
      const AroundVertex around{w};
      team_.each(movers, [&w](int i) { begin_move(w, w.winner(i) = w.to_gather(i)); });
      team_.sync();
      clear(kToGather, 1);
      team_.pull(w, block_.field, movers, around);
      team_.each(movers, [&w](int i) { choose_height(w, w.winner(i)); });
      team_.sync();
      for (int attempt = 0; attempt < 2; ++attempt) {
        team_.measure(w, block_.field, movers, around);
        team_.each(movers, [&w, attempt](int i) { yield_height(w, w.winner(i), attempt); });
        team_.sync();
      }
      team_.each(movers, [&w, &team](int i) {
        const int u = w.winner(i);
        commit_height(w, u);
        for (int k = 0; k < w.valence(u); ++k) {
          const int v = w.entry(u, k);
          if (w.key(v) != kNever && team.place(&w.waits(v)) == -1)
            w.to_gather(team.place(&w.counter(kToGather))) = static_cast<std::uint16_t>(v);
        }
      });
      team_.sync();
    }
    team_.each_open(w, count_, [&w](int u) { ask_again(w, u); });
    team_.sync();
  }

  Team& team_;
  const PassView& pass_;
  const BlockView& block_;
  const std::uint32_t number_;
  const std::uint32_t* const order_;
  const int count_;
  const WindowView w_;
};

}  // namespace cordillera::gpu::exact
