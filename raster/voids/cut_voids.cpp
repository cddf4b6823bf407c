#include "raster/voids/cut_voids.h"

#include <array>
#include <cmath>
#include <vector>

#include "proto/mesh.h"

namespace cordillera::raster {
namespace {

constexpr std::int64_t kMostVertices = 1 << 16;

enum class Seen : std::uint8_t { data, none, end };
using Ring = std::vector<Seen>;

/// Vertices of one side, the last of them first where the way around goes back.
proto::Result<void> add_side(Source& source, const proto::Lattice& lattice, const Source::Window& side, bool back, Ring& ring) {
  const auto samples = source.sample(lattice, side.west, side.south, static_cast<std::int32_t>(side.east - side.west + 1),
                                     static_cast<std::int32_t>(side.north - side.south + 1));
  if (!samples.ok()) return samples.problem();
  Ring seen;
  for (const std::int32_t height : samples->height) seen.push_back(height == proto::kNoHeight ? Seen::none : Seen::data);
  if (back)
    ring.insert(ring.end(), seen.rbegin(), seen.rend());
  else
    ring.insert(ring.end(), seen.begin(), seen.end());
  return {};
}

/// Data, voids and data again on the way around. Twice, for the voids may lie where it begins.
bool has_voids_between(const Ring& ring) {
  bool data = false, voids = false;
  for (int turn = 0; turn < 2; ++turn) {
    for (const Seen seen : ring) {
      if (seen == Seen::data && voids) return true;
      voids = seen == Seen::none && data;
      data = seen != Seen::end && (data || seen == Seen::data);
    }
  }
  return false;
}

}  // namespace

proto::Result<bool> cuts_voids(Source& source, const proto::Lattice& lattice, std::span<const double> bbox) {
  const auto& data = source.description().bbox();
  if (bbox.size() != 4 || data.size() != 4) return false;
  const auto is_cut = [&](std::size_t side) {
    constexpr double kSame_deg = 1e-9;
    return std::abs(std::remainder(data[static_cast<int>(side)] - bbox[side], 360)) < kSame_deg;
  };
  const Source::Window w = source.window(lattice);
  if (2 * (w.east - w.west + w.north - w.south) > kMostVertices) return false;
  struct Side {
    std::size_t of_bbox;
    Source::Window vertices;
    bool back;
  };
  const std::array<Side, 4> around{{{1, {w.west, w.south, w.east, w.south}, false},
                                    {2, {w.east, w.south, w.east, w.north}, false},
                                    {3, {w.west, w.north, w.east, w.north}, true},
                                    {0, {w.west, w.south, w.west, w.north}, true}}};
  Ring ring;
  for (const Side& side : around) {
    if (!is_cut(side.of_bbox))
      ring.push_back(Seen::end);
    else if (auto added = add_side(source, lattice, side.vertices, side.back, ring); !added.ok())
      return added.problem();
  }
  return has_voids_between(ring);
}

}  // namespace cordillera::raster
