#include "server/cli/sources.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <iostream>

#include "pipeline/build/blank_manifest.h"
#include "pipeline/threads/workers.h"
#include "proto/utf8.h"
#include "raster/mosaic/datum_notes.h"
#include "raster/mosaic/source_list.h"
#include "raster/storage/storage.h"

namespace cordillera::server {
namespace {

// Rasters that are examined at once. What takes time is waiting for a storage, not a processor: a second for each of ten thousand
// objects is hours.
constexpr unsigned kExaminers = 16;

using proto::Problem;
using raster::MosaicMember;

/// A raster that the command line names, alone or in a list.
struct Named {
  raster::ListedSource source;
  proto::BuildOptions options;
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
      named.push_back({std::move(source), *options, word});
    }
  }
  return named;
}

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
    if (*examined[k] || bad == BadSource::skip || raster::lies_beside(examined[k]->problem())) return;
    for (std::size_t before = first_bad; k < before && !first_bad.compare_exchange_weak(before, k);) {}
  });
  return examined;
}

/// What a folder has and is not taken from it.
std::vector<std::string> notes_on_texts(const std::vector<std::string>& words) {
  std::vector<std::string> notes;
  for (const std::string& word : words)
    if (auto note = raster::note_on_texts(word)) notes.push_back(std::move(*note));
  return notes;
}

Problem beside_all(const std::vector<Named>& named) {
  std::vector<MosaicMember> asked;
  for (const Named& one : named) {
    MosaicMember& member = asked.emplace_back();
    member.path = one.source.path;
    member.name = fs::path(one.source.path).filename().string();
    member.options = one.options;
  }
  return raster::beside_all(asked);
}

/// What could not be fetched now, or had no room here, is no bad raster: the next time it would be among the others.
bool is_of_storage(const Problem& problem) { return problem.type.starts_with("storage-"); }

}  // namespace

proto::Result<Sources> examine_sources(const std::vector<std::string>& words, const Settings& settings, BadSource bad) {
  const auto named = all_named(words, settings);
  if (!named) return named.problem();
  auto examined = examine_all(*named, settings.build.threads(), bad);
  Sources sources;
  std::optional<Problem> beside;
  for (std::size_t k = 0; k < named->size(); ++k) {
    proto::Result<MosaicMember>& member = *examined[k];
    const std::string& path = (*named)[k].source.path;
    if (member) {
      sources.members.push_back(std::move(*member));
    } else if (raster::lies_beside(member.problem())) {
      beside = member.problem();
    } else if (bad == BadSource::skip && !is_of_storage(member.problem())) {
      sources.skipped.push_back(path + ": " + member.problem().line());
      sources.notes.push_back(proto::as_utf8(fs::path(path).filename().string()) + " was left out, for it cannot be used (" +
                              member.problem().type + ")");
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
  if (sources.members.empty() && beside && sources.skipped.empty()) return named->size() > 1 ? beside_all(*named) : *beside;
  if (sources.members.empty()) {
    return Problem{"sources-invalid",
                   "none of the rasters can be used" + (sources.skipped.empty() ? "" : "; the first: " + sources.skipped.front()),
                   "at least one raster that can be read, inside the bbox", ""};
  }
  for (std::string& note : notes_on_texts(words)) {
    sources.warnings.push_back(note);
    sources.notes.push_back(std::move(note));
  }
  for (auto note : {pipeline::note_on_voids(sources.members), pipeline::note_on_hidden(sources.members)})
    if (note) sources.warnings.push_back(std::move(*note));
  for (std::string& note : raster::notes_on_datums(sources.members)) {
    sources.warnings.push_back(note);
    sources.notes.push_back(std::move(note));
  }
  return sources;
}

proto::Result<pipeline::BuildRequest> request_of(const std::vector<std::string>& words, const Settings& settings, BadSource bad) {
  pipeline::BuildRequest request;
  request.options = settings.build;
  request.raster_name = fs::path(words.front()).filename().string();
  const auto listed = raster::list_sources(words.front());
  if (!listed) return listed.problem();
  if (words.size() == 1 && listed->size() == 1 && listed->front().options.empty()) {
    request.raster_path = listed->front().path;
    request.raster_name = fs::path(request.raster_path).filename().string();
    for (const std::string& note : notes_on_texts(words)) {
      std::cerr << "cordillera: warning: " << note << "\n";
      request.options.add_warnings(note);
    }
    return request;
  }
  auto sources = examine_sources(words, settings, bad);
  if (!sources) return sources.problem();
  for (const std::string& skipped : sources->skipped) std::cerr << "cordillera: left out: " << skipped << "\n";
  for (const std::string& warning : sources->warnings) std::cerr << "cordillera: warning: " << warning << "\n";
  for (const std::string& note : sources->notes) request.options.add_warnings(note);
  request.members = std::move(sources->members);
  return request;
}

}  // namespace cordillera::server
