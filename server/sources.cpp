#include "server/sources.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "proto/mesh.h"
#include "raster/source_list.h"

namespace cordillera::server {
namespace {

constexpr std::size_t kMostWarnings = 20;
constexpr int kMeetingLevel = 12;  // of the lattice on which overlapping rasters are compared: 38 m

using proto::Problem;
using raster::MosaicMember;
using raster::Source;

/// The build's options with those of one raster over them.
proto::Result<proto::BuildOptions> options_of(const raster::ListedSource& source, const Settings& settings) {
  std::vector<OptionSpec> table;
  for (const OptionSpec& option : build_options()) {
    for (const char* own : {"crs", "vertical-datum", "nodata", "source-nodata", "z-scale", "z-offset"}) {
      if (option.name == own) table.push_back(option);
    }
  }
  const auto layered = with_layer(settings, table, source.options, Spelling::query);
  if (!layered) {
    Problem problem = layered.problem();
    problem.detail = source.path + ": " + problem.detail;
    return problem;
  }
  return layered->build;
}

/// Of two rasters where they overlap; nullopt where they do not, or have no data at its middle.
std::optional<double> difference_m(const MosaicMember& a, const MosaicMember& b) {
  const proto::Lattice lattice{proto::Scheme::geodetic, kMeetingLevel};
  const Source::Window one = raster::coarser(a.window, lattice), two = raster::coarser(b.window, lattice);
  if (!raster::touch(one, two, lattice)) return std::nullopt;
  const std::int64_t column = (std::max(one.west, two.west) + std::min(one.east, two.east)) / 2;
  const std::int64_t row = (std::max(one.south, two.south) + std::min(one.north, two.north)) / 2;
  std::int32_t heights[2];
  for (int k = 0; k < 2; ++k) {
    const MosaicMember& m = k == 0 ? a : b;
    const auto source = raster::open_source(m.path, m.name, m.trust, m.options);
    if (!source.ok()) return std::nullopt;
    const auto sample = (*source)->sample(lattice, column, row, 1, 1);
    if (!sample.ok() || sample->height[0] == proto::kNoHeight) return std::nullopt;
    heights[k] = sample->height[0];
  }
  return (static_cast<double>(heights[0]) - heights[1]) * proto::kHeightStep_m;
}

std::string datum_of(const MosaicMember& m) { return m.description.vertical_datum() + " (" + m.description.vertical_datum_from() + ")"; }

void warn_of_datums(Sources& sources) {
  const auto& members = sources.members;
  for (std::size_t a = 0; a < members.size(); ++a) {
    for (std::size_t b = a + 1; b < members.size() && sources.warnings.size() < kMostWarnings; ++b) {
      if (members[a].description.vertical_datum() == members[b].description.vertical_datum()) continue;
      const auto apart_m = difference_m(members[a], members[b]);
      if (!apart_m) continue;
      char text[32];
      std::snprintf(text, sizeof text, "%.2f m", std::abs(*apart_m));
      sources.warnings.push_back(members[a].name + " counts from " + datum_of(members[a]) + ", " + members[b].name + " from " +
                                 datum_of(members[b]) + "; in the middle of their overlap they are " + text + " apart");
    }
  }
}

}  // namespace

proto::Result<Sources> examine_sources(const std::vector<std::string>& words, const Settings& settings, BadSource bad) {
  Sources sources;
  for (const std::string& word : words) {
    const auto listed = raster::list_sources(word);
    if (!listed) return listed.problem();
    for (const raster::ListedSource& source : *listed) {
      const auto options = options_of(source, settings);
      if (!options) return options.problem();
      const std::string name = std::filesystem::path(source.path).filename().string();
      auto member = raster::examine(source.path, name, raster::Trust::operator_file, *options);
      if (member) {
        sources.members.push_back(std::move(*member));
      } else if (listed->size() > 1 && member.problem().type == "bbox-outside-raster") {
        continue;
      } else if (bad == BadSource::skip) {
        sources.skipped.push_back(source.path + ": " + member.problem().line());
      } else {
        Problem problem = member.problem();
        if (words.size() > 1 || listed->size() > 1) problem.detail = source.path + ": " + problem.detail;
        return problem;
      }
    }
  }
  if (sources.members.empty()) {
    return Problem{"sources-invalid", "none of the rasters can be used" + (sources.skipped.empty() ? "" : "; the first: " + sources.skipped.front()),
                   "at least one raster that can be read, inside the bbox", ""};
  }
  warn_of_datums(sources);
  return sources;
}

}  // namespace cordillera::server
