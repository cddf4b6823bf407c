#pragma once
// What a wave of collapses does to winners and to those around them.
#include "gpu/fit/steps/edge_rules.h"
#include "gpu/fit/steps/wave_view.h"

namespace cordillera::gpu::fit {

struct StartVertex {
  FitMesh mesh;
  WaveView wave;
  bool has_planes = false;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto v = static_cast<std::uint32_t>(i);
    wave.mark[v] = kStale;
    wave.cost[v] = mesh.vertex[v].gone() ? kNever : -kNever;
    if (!has_planes) wave.planes[v] = planes_of(mesh, v);
    wave.spent[v] = 0;
    wave.lock[v] = ~std::uint64_t{0};
  }
};

struct TakeAsEstimate {
  WaveView wave;
  CORDILLERA_HD void operator()(std::uint32_t v) const { wave.mark[v] |= kStale; }
};

/// The edge becomes its end of lower number; whoever sees it is touched.
struct Collapse {
  FitMesh mesh;
  WaveView wave;

  CORDILLERA_HD void operator()(std::uint32_t u) const {
    const Intent intent = wave.intent[u];
    const std::uint32_t v = mesh.row(u)[intent.slot];
    Vertex& kept = mesh.vertex[u];
    Vertex& gone = mesh.vertex[v];
    join_rows(u, intent.slot);
    const float z = kept.fixed() ? kept.z : gone.fixed() ? gone.z : intent.z;
    wave.planes[u] = together(planes_from(u, intent.at, z), planes_from(v, intent.at, z));
    wave.intent[u].z = kept.z = z;
    kept.flags |= gone.flags & (kOpen | kFixed);
    kept.steep = kept.steep > gone.steep ? kept.steep : gone.steep;
    kept.x = intent.at.x;
    kept.y = intent.at.y;
    gone.flags = kGone;
    wave.into[v] = u;
    wave.cost[v] = kNever;
    wave.mark[v] = 0;
  }

 private:
  CORDILLERA_HD void join_rows(std::uint32_t u, std::uint32_t slot) const {
    constexpr std::uint32_t kLongest = 256;
    std::uint32_t ring[kLongest];
    const std::uint32_t count = merged_ring(mesh, u, slot, ring);
    std::uint32_t* const row = mesh.row(u);
    for (std::uint32_t k = 0; k < count; ++k) {
      row[k] = ring[k];
      touch(ring[k]);
    }
    mesh.vertex[u].valence = static_cast<std::uint16_t>(count);
    touch(u);
  }
  CORDILLERA_HD void touch(std::uint32_t v) const {
    set_shared(wave.mark + v, static_cast<std::uint8_t>(get_shared(wave.mark + v) | kTouched));
  }
  CORDILLERA_HD Planes planes_from(std::uint32_t v, Point to, float z) const {
    const Vertex& at = mesh.vertex[v];
    return wave.planes[v].seen_from(static_cast<float>(to.x - at.x) * mesh.cells_per_unit,
                                    static_cast<float>(to.y - at.y) * mesh.cells_per_unit, z - at.z);
  }
};

struct IsTouched {
  WaveView wave;
  CORDILLERA_HD bool operator()(std::uint32_t v) const { return (wave.mark[v] & kTouched) != 0; }
};

/// A touched vertex names those of its row that are gone by what they became; an edge's two ends stand side by side. Its intent
/// stays, unless it was for one that is gone.
struct MendRow {
  FitMesh mesh;
  WaveView wave;

  CORDILLERA_HD void operator()(std::uint32_t v) const {
    Vertex& at = mesh.vertex[v];
    std::uint32_t* const row = mesh.row(v);
    const std::uint32_t valence = at.valence, wanted = wave.intent[v].slot;
    std::uint32_t count = 0, first = v, last = v, slot = wanted;
    bool stale = (wave.mark[v] & kStale) != 0;
    for (std::uint32_t begin = 0; begin < valence; begin += kAtOnce) {
      std::uint32_t ring[kAtOnce];
      bool gone[kAtOnce];
      for (std::uint32_t k = 0; k < kAtOnce; ++k) {
        ring[k] = row[begin + k < valence ? begin + k : begin];
        gone[k] = mesh.vertex[ring[k]].gone();
      }
      for (std::uint32_t k = 0; k < kAtOnce && begin + k < valence; ++k) {
        const std::uint32_t w = gone[k] ? wave.into[ring[k]] : ring[k];
        stale |= gone[k] && begin + k == wanted;
        if (count == 0) first = w;
        if (last != w) row[count++] = last = w;
        if (begin + k == wanted) slot = count - 1;
      }
    }
    if (count > 1 && last == first) --count;
    at.valence = static_cast<std::uint16_t>(count);
    wave.mark[v] = static_cast<std::uint8_t>(stale ? kStale : 0);
    wave.intent[v].slot = slot >= count ? 0 : slot;
    if (stale && wave.cost[v] == kNever) wave.cost[v] = -kNever;
  }
};

/// What an edge's owner must look at anew.
CORDILLERA_HD inline void make_stale(const WaveView& wave, std::uint32_t v) {
  set_shared(wave.mark + v, std::uint8_t{kStale});
  if (get_shared(wave.cost + v) == kNever) set_shared(wave.cost + v, -kNever);  // had no way out; may have one now
}
CORDILLERA_HD inline void make_edges_stale(const FitMesh& mesh, const WaveView& wave, std::uint32_t v) {
  const std::uint32_t* const row = mesh.row(v);
  for (std::uint32_t k = 0; k < mesh.vertex[v].valence; ++k) {
    if (row[k] < v) make_stale(wave, row[k]);
  }
  make_stale(wave, v);
}

/// New planes of a touched vertex; the edges that see them are stale.
struct RenewPlanes {
  FitMesh mesh;
  WaveView wave;
  CORDILLERA_HD void operator()(std::uint32_t v) const {
    wave.planes[v] = planes_of(mesh, v);
    make_edges_stale(mesh, wave, v);
  }
};

/// Where planes are carried, only those of winners change. Their last step moved the vertex, not the planes. Owners of edges to
/// it look anew if it was their cheapest, or has become that.
struct FollowVertex {
  FitMesh mesh;
  WaveView wave;

  CORDILLERA_HD void operator()(std::uint32_t v) const {
    const Vertex& at = mesh.vertex[v];
    const Intent& from = wave.intent[v];
    wave.planes[v] = wave.planes[v].seen_from(static_cast<float>(at.x - from.at.x) * mesh.cells_per_unit,
                                              static_cast<float>(at.y - from.at.y) * mesh.cells_per_unit, at.z - from.z);
    const std::uint32_t* const row = mesh.row(v);
    for (std::uint32_t k = 0; k < at.valence; ++k) {
      if (row[k] < v && concerns(row[k], v)) make_stale(wave, row[k]);
    }
    make_stale(wave, v);
  }

 private:
  CORDILLERA_HD bool concerns(std::uint32_t owner, std::uint32_t v) const {
    const float cost = get_shared(wave.cost + owner);
    if ((get_shared(wave.mark + owner) & kStale) || cost >= kNever || mesh.row(owner)[wave.intent[owner].slot] == v) return true;
    if ((mesh.vertex[owner].flags | mesh.vertex[v].flags) & (kOpen | kFixed)) return true;
    return EdgeQuadric(mesh, wave.planes, owner, v).best(Leeway::anywhere).cost < cost;
  }
};

}  // namespace cordillera::gpu::fit
