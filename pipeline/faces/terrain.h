#pragma once
// A published dataset as its faces see it: the store, its meshes decoded, heights between vertices, and the geoid.
#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "pipeline/faces/document.h"
#include "pipeline/faces/look.h"
#include "pipeline/faces/mesh_index.h"
#include "pipeline/store/store.h"
#include "proto/lru.h"

namespace cordillera::raster {
class Geoid;
}

namespace cordillera::pipeline::faces {

class OutlineFill;

/// Thread-safe. What was decoded or made lately is kept, within bounds; it goes with the object.
class Terrain {
 public:
  /// stop: asked once a tile by what goes over many; may be null.
  explicit Terrain(std::shared_ptr<const StoreReader> store, Look look = {}, const std::atomic<bool>* stop = nullptr);
  ~Terrain();

  const StoreReader& store() const { return *store_; }
  const proto::Manifest& manifest() const { return store_->manifest(); }
  proto::Lattice lattice() const;
  const Look& look() const { return look_; }
  bool is_stopped() const { return stop_ != nullptr && *stop_; }

  /// A tile's mesh, decoded from the .drc that clients get, ready to be asked for heights. Null where the store has no tile.
  /// Throws StoreError where its bytes are damaged.
  std::shared_ptr<const MeshIndex> mesh(const proto::TileAddress& tile) const;

  /// A stored tile as clients get it. Those asked for lately are kept, and shared by all who read them.
  std::optional<Document> tile(const proto::TileAddress& tile, Encoding encoding) const;
  /// Its tag alone: its bytes are not read.
  std::optional<std::string> tile_tag(const proto::TileAddress& tile, Encoding encoding) const;

  /// Metres above the ellipsoid of the flat triangle over a place, in the mesh of the level; none beside the data and in holes.
  /// Longitude in [-180, 180], latitude in [-90, 90].
  std::optional<double> height_m(int level, double longitude_deg, double latitude_deg) const;
  /// Of a provisional dataset fine levels are there in part: what they do not show, coarser ones do, down to this one. Else the
  /// level itself.
  int coarsest_for(int level) const;

  /// What orthometric heights of this dataset count from: the source's own datum, EGM96 where that is the ellipsoid itself or a
  /// grid that is not here.
  const std::string& geoid_name() const;
  /// Height of that geoid above the ellipsoid, metres. A problem where no geoid grid is installed.
  proto::Result<double> undulation_m(double longitude_deg, double latitude_deg) const;
  /// The same for a row of places on one parallel.
  proto::Result<void> undulations_m(double latitude_deg, std::span<const double> longitude_deg, double* out) const;

  /// What pictures show where there is no data; made once. A problem beyond Web Mercator's ends and without a geoid.
  proto::Result<std::shared_ptr<const OutlineFill>> outline() const;

  /// What make gives, kept under a name. make: () -> Result<optional<Document>>.
  template <class Make>
  proto::Result<std::optional<Document>> kept(const std::string& name, const Make& make) const {
    if (auto found = documents_.find(name)) return found;
    auto fresh = make();
    if (fresh.ok() && *fresh) documents_.keep(name, **fresh, (*fresh)->bytes.size() + name.size());
    return fresh;
  }

  /// The tag of a document that was made before and need not be kept: who has it already is told so without making it again.
  std::optional<std::string> known_tag(const std::string& name) const { return tags_.find(name); }
  void note_tag(const std::string& name, const std::string& tag) const { tags_.keep(name, tag, name.size() + tag.size()); }

  /// Memory that what is kept takes at the moment. Waits for nothing that is being made.
  std::size_t kept_bytes() const {
    return meshes_.bytes() + documents_.bytes() + tiles_.bytes() + tags_.bytes() + store_->cache_bytes() + outline_bytes_;
  }

 private:
  std::optional<double> height_on(int level, double longitude_deg, double latitude_deg) const;
  std::optional<double> height_at_pole(int level, double latitude_deg) const;
  struct Undulation;
  Undulation& undulation() const;

  std::shared_ptr<const StoreReader> store_;
  Look look_;
  const std::atomic<bool>* const stop_;
  mutable proto::Lru<proto::TileAddress, std::shared_ptr<const MeshIndex>> meshes_;
  mutable proto::Lru<std::string, Document> documents_;
  mutable proto::Lru<std::pair<proto::TileAddress, Encoding>, Document> tiles_;
  mutable proto::Lru<std::string, std::string> tags_;
  mutable std::mutex geoid_mutex_;
  mutable std::unique_ptr<Undulation> undulation_;
  mutable std::mutex outline_mutex_;
  mutable std::shared_ptr<const OutlineFill> outline_;
  mutable std::atomic<std::size_t> outline_bytes_{0};  // beside the mutex, which whoever makes the outline holds for long
};

}  // namespace cordillera::pipeline::faces
