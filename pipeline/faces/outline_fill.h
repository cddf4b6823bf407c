#pragma once
// Heights where a dataset has none, for pictures of heights that cannot say so: a hole gets what lies around it, and outside the
// data's outline the ground goes down to the geoid slowly. Every pixel is a function of the dataset alone, so tiles meet.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline/faces/map_window.h"
#include "proto/result.h"

namespace cordillera::pipeline::faces {

/// The data's outline with holes closed, and the heights around it, at an overview: the last zoom at which the dataset is at most
/// kOverviewPixels long. Immutable, so thread-safe.
class OutlineFill {
 public:
  static constexpr std::int32_t kOverviewPixels = 256;
  /// How far outside the outline the geoid is reached, in pixels of the overview: as far as the greatest height is high, within
  /// these. At coarser zooms the least is as many metres, and the most as many of their pixels: small data on high ground would
  /// be a needle, and flat in their means.
  static constexpr std::int32_t kLeastFade = 16, kMostFade = 64;

  /// The dataset must have something within Web Mercator. A problem without a geoid.
  static proto::Result<OutlineFill> of(const Terrain& terrain);

  /// Gives every pixel that is not a number a height above the geoid. The others stay.
  ///
  /// A pixel starts with what the next coarser zoom has there, its meshes first, filled by the same rule down to the overview.
  /// Then some rounds of averaging join it to the data beside it.
  proto::Result<void> fill(const Terrain& terrain, MapWindow& window) const;

  /// Whether a place without data lies in a hole, and not within a pixel of the overview of the outside. False in doubt.
  bool inside(int zoom, std::int64_t column, std::int64_t row) const;
  /// Whether any pixel of the window is not a number and inside.
  bool holes_in(const MapWindow& window) const;

  /// Whether the outline, and what fades around it if that is asked for, can reach into the tile.
  bool reaches(int zoom, std::int32_t x, std::int32_t y, bool faded) const;

  std::size_t bytes() const;

 private:
  double height_m(int zoom, std::int64_t column, std::int64_t row) const;
  bool hull(std::int64_t column, std::int64_t row) const;
  std::int64_t turned(int zoom, std::int64_t column) const;

  std::vector<MapWindow> filled_;  // the overview, then each coarser zoom
  std::vector<bool> hull_;         // indexed like the overview: data, or a hole in it
};

}  // namespace cordillera::pipeline::faces
