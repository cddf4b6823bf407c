#pragma once
// Between the meshes on a device and the strips at shared sides, which the host makes: the hem goes up, what has changed comes
// down.
#include "gpu/exact/cut.h"
#include "gpu/exact/strip.h"

namespace cordillera::gpu::exact {

struct IsOnHem {
  MeshView mesh;
  const BlockView* blocks;  ///< of the own meshes, which end at the hem
  CutView finder;
  CORDILLERA_HD bool operator()(std::uint32_t v) const {
    const BlockView& block = blocks[finder.block_of(v)];
    const int x = position_x(mesh.position[v]), y = position_y(mesh.position[v]);
    return block.is_on_held_side(x, y);
  }
};
struct TakeHemVertex {
  MeshView mesh;
  const BlockView* blocks;
  CutView finder;
  const std::uint32_t* vertices;
  RingedVertex* to;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t v = vertices[i], block = finder.block_of(v), first = finder.first_vertex[block];
    const Field& field = blocks[block].field;
    RingedVertex taken;
    taken.vertex = v - first;
    taken.position = mesh.position[v];
    taken.height = mesh.height[v];
    taken.mark = mesh.mark[v];
    taken.valence = mesh.valence[v];
    taken.depth = field.depth ? field.depth[field.index(position_x(taken.position), position_y(taken.position))] : Depth{0};
    for (int k = 0; k < taken.valence; ++k) taken.ring[k] = mesh.ring_of(v)[k] - first;
    to[i] = taken;
  }
};
struct HoldVertex {
  const std::uint32_t* vertices;
  MeshView mesh;
  CORDILLERA_HD void operator()(std::size_t i) const { mesh.mark[vertices[i]] |= kHeld; }
};
/// A block's own mesh, with room behind it for what is added. All but what is near the strip is settled.
struct CopyOwn {
  MeshView from, to;
  CutView finder;                     ///< of the own meshes
  const std::uint32_t* first_vertex;  ///< indexed by block: where its vertices come to lie
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto v = static_cast<std::uint32_t>(i);
    const std::uint32_t block = finder.block_of(v), first = finder.first_vertex[block], shift = first_vertex[block] - first,
                        n = v + shift;
    to.position[n] = from.position[v];
    to.height[n] = from.height[v];
    to.valence[n] = from.valence[v];
    to.mark[n] = static_cast<std::uint8_t>((from.mark[v] & ~kHeld) | kSettled);
    for (int k = 0; k < from.valence[v]; ++k) to.ring_of(n)[k] = from.ring_of(v)[k] + shift;
  }
};
/// Vertices of strips and of hems; numbers are those of all meshes.
struct PlaceVertex {
  const RingedVertex* vertices;
  MeshView mesh;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const RingedVertex& v = vertices[i];
    mesh.position[v.vertex] = v.position;
    mesh.height[v.vertex] = v.height;
    mesh.valence[v.vertex] = v.valence;
    mesh.mark[v.vertex] = v.mark;
    for (int k = 0; k < v.valence; ++k) mesh.ring_of(v.vertex)[k] = v.ring[k];
  }
};
/// Their neighbours are asked again.
struct WakeNeighbours {
  const RingedVertex* vertices;
  MeshView mesh;
  CORDILLERA_HD void operator()(std::size_t i) const {
    for (int k = 0; k < vertices[i].valence; ++k) {
      std::uint8_t& mark = mesh.mark[vertices[i].ring[k]];
      set_shared(&mark, static_cast<std::uint8_t>(get_shared(&mark) & ~kSettled));
    }
  }
};

}  // namespace cordillera::gpu::exact
