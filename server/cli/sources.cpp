#include "server/cli/sources.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "pipeline/build/blank_manifest.h"
#include "pipeline/threads/workers.h"
#include "proto/mesh.h"
#include "raster/mosaic/source_list.h"
#include "raster/mosaic/window_index.h"
#include "raster/storage/storage.h"

namespace cordillera::server {
namespace {

constexpr std::size_t kMostWarnings = 20;
constexpr proto::Lattice kMeeting{12};  // where overlapping rasters are compared: 38 m
// Rasters that are examined at once. What takes time is waiting for a storage, not a processor: a second for each of ten thousand
// objects is hours.
constexpr unsigned kExaminers = 16;

using proto::Problem;
using raster::MosaicMember;
using raster::Source;

/// Of two rasters whose windows of kMeeting overlap; nullopt where one has no data in the middle.
std::optional<double> difference_m(const MosaicMember& a, const MosaicMember& b) {
  const Source::Window one = raster::coarser(a.window, kMeeting), two = raster::coarser(b.window, kMeeting);
  const std::int64_t column = (std::max(one.west, two.west) + std::min(one.east, two.east)) / 2;
  const std::int64_t row = (std::max(one.south, two.south) + std::min(one.north, two.north)) / 2;
  std::int32_t heights[2];
  for (int k = 0; k < 2; ++k) {
    const MosaicMember& m = k == 0 ? a : b;
    const auto source = raster::open_source(m.path, m.name, m.trust, m.options);
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

void warn_of_datums(Sources& sources) {
  const auto& members = sources.members;
  std::vector<Source::Window> windows;
  for (const MosaicMember& member : members) windows.push_back(raster::coarser(member.window, kMeeting));
  const raster::WindowIndex index(windows, kMeeting);
  for (std::size_t a = 0; a < members.size() && sources.warnings.size() < kMostWarnings; ++a) {
    for (const std::uint32_t b : index.touching(windows[a])) {
      if (b <= a || sources.warnings.size() >= kMostWarnings) continue;
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

/// A raster that the command line names, alone or in a list.
struct Named {
  raster::ListedSource source;
  proto::BuildOptions options;
  bool alone = false;
  std::string word;  ///< what the command line says: the raster, or the list or folder that has it
};

proto::Result<std::vector<Named>> all_named(const std::vector<std::string>& words, const Settings& settings) {
  std::vector<Named> named;
  for (const std::string& word : words) {
    auto listed = raster::list_sources(word);
    if (!listed) return listed.problem();
    for (raster::ListedSource& source : *listed) {
      const auto options = with_listed_layer(settings, source.options, source.path);
      if (!options) return options.problem();
      named.push_back({std::move(source), *options, listed->size() == 1, word});
    }
  }
  return named;
}

bool lies_beside(const Named& named, const Problem& problem) { return !named.alone && problem.type == "bbox-outside-raster"; }

/// Each examined, in any order; with BadSource::refuse, those behind the first bad one may be left out.
std::vector<std::optional<proto::Result<MosaicMember>>> examine_all(const std::vector<Named>& named, unsigned threads,
                                                                    BadSource bad) {
  std::vector<std::optional<proto::Result<MosaicMember>>> examined(named.size());
  std::atomic<std::size_t> first_bad{named.size()};
  const auto count = static_cast<unsigned>(std::min<std::size_t>(threads > 0 ? threads : kExaminers, named.size()));
  pipeline::Workers(std::max(count, 1u)).each(named.size(), [&](std::size_t k, unsigned) {
    if (k > first_bad) return;
    const std::string& path = named[k].source.path;
    // Of one in a storage pixels cost another request.
    const auto look = raster::is_remote(path) ? raster::examine : raster::examine_pixels;
    examined[k] = look(path, std::filesystem::path(path).filename().string(), raster::Trust::operator_file, named[k].options);
    if (*examined[k] || bad == BadSource::skip || lies_beside(named[k], examined[k]->problem())) return;
    for (std::size_t before = first_bad; k < before && !first_bad.compare_exchange_weak(before, k);) {}
  });
  return examined;
}

}  // namespace

proto::Result<Sources> examine_sources(const std::vector<std::string>& words, const Settings& settings, BadSource bad) {
  const auto named = all_named(words, settings);
  if (!named) return named.problem();
  auto examined = examine_all(*named, settings.build.threads(), bad);
  Sources sources;
  for (std::size_t k = 0; k < named->size(); ++k) {
    proto::Result<MosaicMember>& member = *examined[k];
    const std::string& path = (*named)[k].source.path;
    if (member) {
      sources.members.push_back(std::move(*member));
    } else if (lies_beside((*named)[k], member.problem())) {
      continue;
    } else if (bad == BadSource::skip) {
      sources.skipped.push_back(path + ": " + member.problem().line());
    } else {
      Problem problem = member.problem();
      const std::string& word = (*named)[k].word;
      if (word != path && !std::filesystem::is_directory(word))
        problem.detail = word + " names " + path + ": " + problem.detail;
      else if (named->size() > 1)
        problem.detail = path + ": " + problem.detail;
      return problem;
    }
  }
  if (sources.members.empty()) {
    return Problem{"sources-invalid",
                   "none of the rasters can be used" + (sources.skipped.empty() ? "" : "; the first: " + sources.skipped.front()),
                   "at least one raster that can be read, inside the bbox", ""};
  }
  if (auto note = pipeline::note_on_voids(sources.members)) sources.warnings.push_back(std::move(*note));
  warn_of_datums(sources);
  return sources;
}

proto::Result<pipeline::BuildRequest> request_of(const std::vector<std::string>& words, const Settings& settings) {
  pipeline::BuildRequest request;
  request.options = settings.build;
  request.raster_name = fs::path(words.front()).filename().string();
  const auto listed = raster::list_sources(words.front());
  if (!listed) return listed.problem();
  if (words.size() == 1 && listed->size() == 1 && listed->front().options.empty()) {
    request.raster_path = listed->front().path;
    request.raster_name = fs::path(request.raster_path).filename().string();
    return request;
  }
  auto sources = examine_sources(words, settings, BadSource::refuse);
  if (!sources) return sources.problem();
  for (const std::string& warning : sources->warnings) std::cerr << "cordillera: warning: " << warning << "\n";
  request.members = std::move(sources->members);
  return request;
}

}  // namespace cordillera::server
