#include "raster/mosaic/datum_notes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <optional>

#include "proto/mesh.h"
#include "proto/utf8.h"
#include "raster/mosaic/window_index.h"

namespace cordillera::raster {
namespace {

constexpr std::size_t kMostNotes = 20;
constexpr proto::Lattice kMeeting{12};  // where overlapping rasters are compared: 38 m

/// Of two rasters whose windows of kMeeting overlap; nullopt where one has no data in the middle.
std::optional<double> difference_m(const MosaicMember& a, const MosaicMember& b) {
  const Source::Window one = coarser(a.window, kMeeting), two = coarser(b.window, kMeeting);
  const std::int64_t column = (std::max(one.west, two.west) + std::min(one.east, two.east)) / 2;
  const std::int64_t row = (std::max(one.south, two.south) + std::min(one.north, two.north)) / 2;
  std::int32_t heights[2];
  for (int k = 0; k < 2; ++k) {
    const MosaicMember& m = k == 0 ? a : b;
    proto::BuildOptions options = m.options;
    options.set_voids("hole");  // a height in their place is nobody's data
    const auto source = open_source(m.path, m.name, m.trust, options);
    if (!source.ok()) return std::nullopt;
    const auto sample = (*source)->sample(kMeeting, column, row, 1, 1);
    if (!sample.ok() || sample->height[0] == proto::kNoHeight) return std::nullopt;
    heights[k] = sample->height[0];
  }
  return (static_cast<double>(heights[0]) - heights[1]) * proto::kHeightStep_m;
}

std::string datum_of(const MosaicMember& m) {
  return m.description.vertical_datum() + " (" + m.description.vertical_datum_from() + ")";
}

}  // namespace

std::vector<std::string> notes_on_datums(const std::vector<MosaicMember>& members) {
  std::vector<std::string> notes;
  std::vector<Source::Window> windows;
  for (const MosaicMember& member : members) windows.push_back(coarser(member.window, kMeeting));
  const WindowIndex index(windows, kMeeting);
  for (std::size_t a = 0; a < members.size() && notes.size() < kMostNotes; ++a) {
    for (const std::uint32_t b : index.touching(windows[a])) {
      if (b <= a || notes.size() >= kMostNotes) continue;
      if (members[a].description.vertical_datum() == members[b].description.vertical_datum()) continue;
      const auto apart_m = difference_m(members[a], members[b]);
      if (!apart_m) continue;
      char text[32];
      std::snprintf(text, sizeof text, "%.2f m", std::abs(*apart_m));
      notes.push_back(proto::as_utf8(members[a].name) + " counts from " + datum_of(members[a]) + ", " +
                      proto::as_utf8(members[b].name) + " from " + datum_of(members[b]) +
                      "; in the middle of their overlap they are " + text + " apart");
    }
  }
  return notes;
}

}  // namespace cordillera::raster
