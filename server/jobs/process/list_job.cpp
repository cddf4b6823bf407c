#include "server/jobs/process/list_job.h"

#include <algorithm>

#include "pipeline/threads/workers.h"
#include "proto/files.h"
#include "proto/letters.h"
#include "proto/utf8.h"
#include "raster/mosaic/source_list.h"
#include "raster/mosaic/vrt_rasters.h"
#include "raster/storage/ranged_file.h"
#include "raster/storage/storage.h"
#include "server/datasets/dataset_folder.h"
#include "server/fetch/listed_rasters.h"
#include "server/fetch/range_asks.h"
#include "server/options/options.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

/// A list may be large, and what it says long: it is told in so many words.
std::optional<Problem> too_large(const std::string& name, const std::vector<raster::ListedSource>& listed) {
  if (listed.size() > updates::kMostListed)
    return Problem{"sources-invalid", name + " names " + std::to_string(listed.size()) + " rasters",
                   "at most " + std::to_string(updates::kMostListed) + " rasters", ""};
  for (std::size_t k = 0; k < listed.size(); ++k) {
    const auto wrong = [&](const std::string& what, const std::string& accepted) {
      return Problem{"sources-invalid", name + ": its raster " + std::to_string(k + 1) + " has " + what, accepted, ""};
    };
    if (listed[k].path.size() > updates::kLongestListed)
      return wrong("a path of " + std::to_string(listed[k].path.size()) + " bytes",
                   "at most " + std::to_string(updates::kLongestListed) + " bytes");
    for (const auto& [option, value] : listed[k].options) {
      // It is said in problems that anybody may read, and could be a piece of an address with its signature.
      const bool is_word = std::all_of(option.begin(), option.end(), [](char c) { return proto::is_letter_or_digit(c, "_-"); });
      if (!is_word || value.size() > updates::kLongestListed) return wrong("an option that is none", "crs, nodata and others");
    }
  }
  return std::nullopt;
}

proto::Result<std::vector<raster::ListedSource>> rasters_of_vrt(const fs::path& file, const std::string& name) {
  const auto found = raster::take_rasters(
      proto::bytes_of_file(file).value_or(""), name,
      [](std::size_t k, const std::string& written) { return raster::name_for_gdal(k, updates::listed_name(written)); });
  if (!found) return found.problem();
  if (const auto kept = raster::write_whole(file.string(), found->text); !kept) return kept.problem();
  std::vector<raster::ListedSource> listed;
  for (const std::string& written : found->written) listed.push_back({written, {}});
  return listed;
}

}  // namespace

proto::Result<void> report_listed(const proto::Job& job, const fs::path& folder,
                                  const std::function<void(const proto::Progress&)>& report) {
  const fs::path file = folder / job.raster();
  const auto listed = job.vrt() ? rasters_of_vrt(file, job.name()) : raster::written_in(file.string(), job.name());
  if (!listed) return listed.problem();
  if (auto refused = too_large(job.name(), *listed)) return *refused;
  for (const raster::ListedSource& source : *listed) {
    const auto options = with_listed_layer(Settings(), source.options, updates::listed_name(source.path));
    if (!options) return options.problem();
    proto::Progress progress;
    progress.mutable_listed()->set_address(proto::as_utf8(source.path));
    *progress.mutable_listed()->mutable_options() = *options;
    report(progress);
  }
  return {};
}

bool have_rasters(const proto::Job& job, const fs::path& folder) {
  const bool may_ask = updates::may_ask();
  std::error_code error;
  raster::RangedFiles ranged;
  ranged.ask = updates::ask_for;
  if (job.rasters().empty()) {
    // A file with holes and nobody to ask has no heights there.
    const fs::path file = folder / job.raster();
    if (!may_ask) return !fs::exists(map_of(file), error);
    // Of what stands at its address: a build goes on where that is the same.
    const std::string state = proto::bytes_of_file(folder / kFetchedFile).value_or("");
    ranged.files.push_back({file.string(), fs::path(job.name()).filename().string(), state});
    return raster::read_by_ranges(std::move(ranged));
  }
  for (const proto::JobRaster& raster : job.rasters()) {
    if (raster.ranged() && !may_ask) return false;
    ranged.files.push_back({raster.path(), raster.name(), raster.state(), !raster.ranged()});
    ranged.vrt_state += raster.state();
  }
  if (job.vrt()) ranged.vrt = (folder / job.raster()).string();
  fs::current_path(folder, error);  // paths of rasters count from there: a folder that was copied has the same state
  return !error && raster::read_by_ranges(std::move(ranged));
}

proto::Result<std::vector<raster::MosaicMember>> examine_listed(const proto::Job& job, const updates::SizeCheck& check) {
  std::vector<raster::MosaicMember> members;
  if (job.vrt() || job.rasters().empty()) return members;
  const auto count = static_cast<std::size_t>(job.rasters_size());
  std::vector<std::optional<proto::Result<raster::MosaicMember>>> examined(count);
  pipeline::Workers(job.options().threads()).each(count, [&](std::size_t k, unsigned) {
    const proto::JobRaster& raster = job.rasters(static_cast<int>(k));
    proto::BuildOptions options = job.options();
    options.MergeFrom(raster.options());
    examined[k] = raster::examine(raster.path(), raster.name(), raster::Trust::posted_file, options);
    if (*examined[k]) (*examined[k])->state = raster.state();
  });
  std::optional<Problem> beside;
  for (auto& member : examined) {
    if (!*member && raster::lies_beside(member->problem())) {
      beside = member->problem();
      continue;
    }
    if (!*member) return member->problem();
    if (auto refused = check((*member)->name, (*member)->description)) return *refused;
    members.push_back(std::move(**member));
  }
  if (members.empty() && beside) return *beside;
  return members;
}

}  // namespace cordillera::server
