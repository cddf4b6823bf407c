#include "server/jobs/process/list_job.h"

#include "pipeline/threads/workers.h"
#include "proto/files.h"
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

Problem too_many(const std::string& name, std::size_t count) {
  return {"sources-invalid", name + " names " + std::to_string(count) + " rasters",
          "at most " + std::to_string(updates::kMostListed) + " rasters", ""};
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
  if (listed->size() > updates::kMostListed) return too_many(job.name(), listed->size());
  std::vector<OptionSpec> table = raster_options();
  std::erase_if(table, [](const OptionSpec& option) { return option.name == "name"; });
  for (const raster::ListedSource& source : *listed) {
    const auto options = with_raster_layer(Settings(), table, source.options);
    if (!options) {
      Problem problem = options.problem();
      problem.detail = updates::listed_name(source.path) + ": " + problem.detail;
      return problem;
    }
    proto::Progress progress;
    progress.mutable_listed()->set_path(source.path);
    *progress.mutable_listed()->mutable_options() = options->build;
    report(progress);
  }
  return {};
}

bool have_rasters(const proto::Job& job, const fs::path& folder) {
  const bool may_ask = updates::may_ask();
  std::error_code error;
  raster::RangedFiles ranged;
  ranged.ask = updates::ask_for;
  // A file with holes and nobody to ask has no heights there. state: of what stands at its address, for a build goes on where
  // that is the same.
  const auto add = [&](const fs::path& file, const std::string& name, const std::string& state) {
    const bool whole = !fs::exists(map_of(file), error);
    ranged.files.push_back({file.string(), name, state, whole});
    return whole || may_ask;
  };
  if (job.rasters().empty()) {
    const fs::path file = folder / job.raster();
    const std::string name = fs::path(job.name()).filename().string();
    if (!add(file, name, proto::bytes_of_file(folder / kFetchedFile).value_or(""))) return false;
    return ranged.files.front().whole || raster::read_by_ranges(std::move(ranged));
  }
  const std::string state = updates::listed_state(folder / kRasters);
  for (const proto::SourceSpec& spec : job.rasters())
    if (!add(folder / spec.path(), spec.name(), state)) return false;
  if (job.vrt()) ranged.vrt = (folder / job.raster()).string();
  return raster::read_by_ranges(std::move(ranged));
}

proto::Result<std::vector<raster::MosaicMember>> examine_listed(const proto::Job& job, const fs::path& folder,
                                                                const updates::SizeCheck& too_large) {
  std::vector<raster::MosaicMember> members;
  if (job.vrt() || job.rasters().empty()) return members;
  const auto count = static_cast<std::size_t>(job.rasters_size());
  std::vector<std::optional<proto::Result<raster::MosaicMember>>> examined(count);
  pipeline::Workers(job.options().threads()).each(count, [&](std::size_t k, unsigned) {
    const proto::SourceSpec& spec = job.rasters(static_cast<int>(k));
    proto::BuildOptions options = job.options();
    options.MergeFrom(spec.options());
    examined[k] = raster::examine((folder / spec.path()).string(), spec.name(), raster::Trust::posted_file, options);
  });
  std::optional<Problem> beside;
  for (auto& member : examined) {
    if (!*member && member->problem().type == "bbox-outside-raster") {
      beside = member->problem();
      continue;
    }
    if (!*member) return member->problem();
    if (auto refused = too_large((*member)->name, (*member)->description)) return *refused;
    members.push_back(std::move(**member));
  }
  if (members.empty() && beside) return *beside;
  return members;
}

}  // namespace cordillera::server
