#include "pipeline/faces/terrain.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "pipeline/faces/outline_fill.h"
#include "pipeline/store/sqlite.h"
#include "raster/datum/geoid.h"
#include "raster/datum/vertical.h"
#include "raster/place/area.h"

namespace cordillera::pipeline::faces {
namespace {

// Of one dataset; a server keeps some dozens of datasets open, and few of them are looked at.
constexpr std::size_t kMostMeshBytes = std::size_t{48} << 20;
constexpr std::size_t kMostDocumentBytes = std::size_t{32} << 20;
constexpr std::size_t kMostTileBytes = std::size_t{32} << 20;
constexpr std::size_t kMostTagBytes = std::size_t{1} << 20;  // of some eight thousand tiles

}  // namespace

/// Opened when first asked for: most requests need no geoid.
struct Terrain::Undulation {
  std::string name;
  std::unique_ptr<raster::Geoid> geoid;
  std::unique_ptr<raster::Geoid> beyond;  ///< where a national grid ends
  std::optional<proto::Problem> problem;
};

Terrain::Terrain(std::shared_ptr<const StoreReader> store, Look look, const std::atomic<bool>* stop)
    : store_(std::move(store)),
      look_(std::move(look)),
      stop_(stop),
      meshes_(kMostMeshBytes),
      documents_(kMostDocumentBytes),
      tiles_(kMostTileBytes),
      tags_(kMostTagBytes) {}
Terrain::~Terrain() = default;

proto::Lattice Terrain::lattice() const { return {static_cast<int>(manifest().max_level())}; }

std::shared_ptr<const MeshIndex> Terrain::mesh(const proto::TileAddress& tile) const {
  if (const auto kept = meshes_.find(tile)) return *kept;
  const auto blob = store_->tile(tile, Encoding::drc);
  if (!blob) return nullptr;
  auto decoded = draco_decode_lattice(blob->bytes);
  if (!decoded) throw StoreError("a tile cannot be decoded: " + decoded.problem().detail);
  if (proto::TileAddress{decoded->z, decoded->x, decoded->y} != tile) throw StoreError("a tile is another one's");
  auto index = std::make_shared<const MeshIndex>(in_mesh_steps(std::move(*decoded)));
  meshes_.keep(tile, index, index->bytes());
  return index;
}

std::optional<Document> Terrain::tile(const proto::TileAddress& tile, Encoding encoding) const {
  if (auto kept = tiles_.find({tile, encoding})) return kept;
  auto blob = store_->tile(tile, encoding);
  if (!blob) return std::nullopt;
  Document document{std::move(blob->bytes), std::move(blob->etag)};
  tiles_.keep({tile, encoding}, document, document.bytes.size() + sizeof(Document));
  return document;
}

std::optional<std::string> Terrain::tile_tag(const proto::TileAddress& tile, Encoding encoding) const {
  if (encoding == Encoding::drc) {
    const auto kept = tiles_.find({tile, encoding});
    return kept ? std::optional(kept->etag) : store_->tag(tile, encoding);
  }
  const auto made = this->tile(tile, encoding);  // its tag is that of its bytes: once they are made, they are worth keeping
  return made ? std::optional(made->etag) : std::nullopt;
}

int Terrain::coarsest_for(int level) const { return manifest().provisional() ? static_cast<int>(manifest().min_level()) : level; }

std::optional<double> Terrain::height_m(int level, double longitude_deg, double latitude_deg) const {
  for (int z = level; z >= coarsest_for(level); --z) {
    const bool pole = std::abs(latitude_deg) == 90;
    if (const auto height = pole ? height_at_pole(z, latitude_deg) : height_on(z, longitude_deg, latitude_deg)) return height;
  }
  return std::nullopt;
}

/// A pole is one point, and data may reach it along a few meridians: any vertex there has its height.
std::optional<double> Terrain::height_at_pole(int level, double latitude_deg) const {
  constexpr std::int32_t kTogether = 256;  // the first tiles will do
  const std::int32_t across = proto::tiles_across(level), row = latitude_deg > 0 ? proto::tiles_up(level) - 1 : 0;
  for (std::int32_t west = 0; west < across; west += kTogether) {
    for (const proto::TileRecord& record : store_->records(level, west, row, std::min(west + kTogether, across) - 1, row)) {
      const double end = latitude_deg > 0 ? record.region(3) : -record.region(1);
      constexpr double kRounded = 1e-9;  // radians
      const auto tile = end > std::numbers::pi / 2 - kRounded ? mesh(address_of(record)) : nullptr;
      if (!tile) continue;
      const std::int32_t side = latitude_deg > 0 ? tile->mesh().side : 0;
      for (const auto& point : tile->mesh().points) {
        if (point[1] == side) return point[2] * tile->mesh().height_step;
      }
    }
  }
  return std::nullopt;
}

std::optional<double> Terrain::height_on(int level, double longitude_deg, double latitude_deg) const {
  // On a common side either tile may be the one that has data there.
  const double tiles_a_degree = std::ldexp(1, level) / 180;
  const double x = (longitude_deg + 180) * tiles_a_degree, y = (latitude_deg + 90) * tiles_a_degree;
  const std::int32_t across = proto::tiles_across(level), up = proto::tiles_up(level);
  for (const double row : {std::floor(y), std::ceil(y) - 1}) {
    for (const double column : {std::floor(x), std::ceil(x) - 1}) {
      if (row < 0 || row >= up) continue;
      const auto wrapped = (static_cast<std::int32_t>(column) + across) % across;
      const auto tile = mesh({level, wrapped, static_cast<std::int32_t>(row)});
      const double longitude = longitude_deg + (wrapped - column) / tiles_a_degree;
      if (const auto height = tile ? tile->height_m(longitude, latitude_deg) : std::nullopt) return height;
    }
  }
  return std::nullopt;
}

Terrain::Undulation& Terrain::undulation() const {
  if (undulation_) return *undulation_;
  undulation_ = std::make_unique<Undulation>();
  const raster::Area area = raster::area_of(manifest().bounds()).value_or(raster::Area{-180, -90, 180, 90});
  const std::string& declared = manifest().source().vertical_datum();
  const std::string wanted = declared == "ellipsoid" ? raster::kDefaultDatum : declared;
  auto datum = raster::resolve_vertical({.requested = wanted, .system = raster::system_named(wanted, raster::Trust::posted_file)},
                                        raster::Trust::posted_file, area);
  if (!datum) datum = raster::resolve_vertical({.requested = raster::kDefaultDatum}, raster::Trust::posted_file, area);
  if (!datum) {
    undulation_->problem = datum.problem();
    return *undulation_;
  }
  if (!datum->grid.empty()) {
    if (auto world = raster::resolve_vertical({.requested = raster::kDefaultDatum}, raster::Trust::posted_file, area))
      undulation_->beyond = std::move(world->geoid);
  }
  undulation_->name = datum->name;
  undulation_->geoid = std::move(datum->geoid);
  return *undulation_;
}

const std::string& Terrain::geoid_name() const {
  const std::lock_guard lock(geoid_mutex_);
  return undulation().name;
}

proto::Result<double> Terrain::undulation_m(double longitude_deg, double latitude_deg) const {
  double out = 0;
  if (const auto found = undulations_m(latitude_deg, std::span(&longitude_deg, 1), &out); !found.ok()) return found.problem();
  return out;
}

proto::Result<void> Terrain::undulations_m(double latitude_deg, std::span<const double> longitude_deg, double* out) const {
  const std::lock_guard lock(geoid_mutex_);
  const Undulation& u = undulation();
  if (u.problem) return *u.problem;
  u.geoid->along_parallel(latitude_deg, longitude_deg, out);
  // Tiles reach beyond the data, and a national grid may end with the country.
  for (std::size_t k = 0; k < longitude_deg.size(); ++k)
    if (std::isnan(out[k])) out[k] = u.beyond ? u.beyond->undulation_m(latitude_deg, longitude_deg[k]) : 0;
  return {};
}

proto::Result<std::shared_ptr<const OutlineFill>> Terrain::outline() const {
  const std::lock_guard lock(outline_mutex_);
  if (!outline_) {
    auto made = OutlineFill::of(*this);
    if (!made) return made.problem();
    outline_bytes_ = made->bytes();
    outline_ = std::make_shared<const OutlineFill>(std::move(*made));
  }
  return outline_;
}

}  // namespace cordillera::pipeline::faces
