// The queue's part for datasets at whose address stands no raster but a list of rasters, or a VRT of them.
#include <fstream>

#include "pipeline/threads/workers.h"
#include "raster/mosaic/source_list.h"
#include "server/datasets/dataset_folder.h"
#include "server/jobs/job_queue.h"
#include "server/log/log.h"
#include "server/options/request_policy.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kAskedAtOnce = 16;  // rasters: what takes time is waiting for their servers

raster::ListKind kind_of(const fs::path& file, const std::string& name) {
  std::string head(512, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return raster::list_kind(head, name);
}

/// What the list says of a raster stands in requests and in a job's options.
std::optional<proto::Problem> refused(const updates::Fetch& fetch, const updates::ListedRaster& raster, const std::string& list) {
  const auto allowed = fetch.allowed(raster.address);
  std::optional<proto::Problem> problem = check_names(raster.options);
  if (!allowed) problem = allowed.problem();
  if (problem) problem->detail = "of " + raster.name + ", which " + list + " names: " + problem->detail;
  return problem;
}

}  // namespace

std::optional<proto::Problem> refuse_list(const fs::path& file, const std::string& name) {
  const raster::ListKind kind = kind_of(file, "");  // by its bytes alone
  if (kind == raster::ListKind::none) return std::nullopt;
  return proto::Problem{
      "raster-format-unsupported",
      name +
          (kind == raster::ListKind::vrt ? " is a VRT, which names other rasters" : " is no raster, but may be a list of some"),
      "build=lazy, with which the rasters that it names are read at their addresses; or each of them by POST …/sources",
      "source"};
}

/// file: what was fetched, still under another name. The rasters of a list then lie beside it, in a folder of such a name.
/// nullopt: it is a raster.
proto::Result<std::optional<updates::ListedRasters>> JobQueue::take_list(const Dataset& dataset, const fs::path& file,
                                                                         Wanted wanted, const std::atomic<bool>& stop) {
  const std::string name = updates::listed_name(dataset.address);
  const raster::ListKind kind = kind_of(file, name);
  if (kind == raster::ListKind::none) return std::optional<updates::ListedRasters>();
  proto::Job job = job_of(dataset);
  job.set_name(name);
  job.set_raster(file.filename().string());
  job.set_list(true);
  job.set_vrt(kind == raster::ListKind::vrt);
  const auto specs = read_list(dataset, job, stop);
  if (!specs) return specs.problem();
  if (specs->empty()) return std::optional<updates::ListedRasters>();
  updates::ListedRasters listed{job.vrt(), {}};
  for (const proto::SourceSpec& spec : *specs) {
    listed.rasters.push_back(
        {updates::listed_address(dataset.address, spec.path()), updates::listed_name(spec.path()), spec.options(), {}});
    if (auto problem = refused(fetch_, listed.rasters.back(), name)) return *problem;
  }
  log_info("dataset " + dataset.id + ": " + name + " names " + std::to_string(listed.rasters.size()) + " rasters");
  if (auto begun = begin_listed(listed, next_rasters(dataset.id), wanted, stop); !begun) return begun.problem();
  return std::optional(std::move(listed));
}

/// As it is told by a job: what a stranger wrote is read where it can do no harm.
proto::Result<std::vector<proto::SourceSpec>> JobQueue::read_list(const Dataset& dataset, proto::Job job,
                                                                  const std::atomic<bool>& stop) {
  const fs::path folder = layout_.dataset(dataset.id);
  limit(job, folder);
  if (!write_job(folder, job)) return cannot_write_job(folder);
  std::vector<proto::SourceSpec> specs;
  const auto outcome = runner_(
      folder,
      [&](const proto::Progress& progress) {
        if (progress.has_listed() && specs.size() < updates::kMostListed) specs.push_back(progress.listed());
      },
      stop);
  if (!outcome) return outcome.problem();
  return specs;
}

/// All of them, or their beginnings, into the folder, with the note of them.
proto::Result<void> JobQueue::begin_listed(updates::ListedRasters& listed, const fs::path& folder, Wanted wanted,
                                           const std::atomic<bool>& stop) const {
  std::error_code error;
  fs::remove_all(folder, error);
  fs::create_directories(folder, error);
  if (error) return cannot_write_job(folder.parent_path());
  std::vector<std::optional<proto::Problem>> problems(listed.rasters.size());
  std::atomic<bool> over{false};
  const auto& fetch = wanted == Wanted::whole ? fetch_.whole : fetch_.beginning;
  const auto most = std::min<std::size_t>(kAskedAtOnce, listed.rasters.size());
  pipeline::Workers(static_cast<unsigned>(most)).each(listed.rasters.size(), [&](std::size_t k, unsigned) {
    if (over) return;
    auto print = fetch(listed.rasters[k].address, folder / updates::file_of(listed, k), stop);
    if (print)
      listed.rasters[k].print = *print;
    else
      problems[k] = print.problem(), over = true;
  });
  for (const auto& problem : problems)
    if (problem) return *problem;
  return updates::write_listed(folder, listed);
}

/// What a job of the dataset reads as it comes; null: its rasters are there. The job is told of those that a list names.
std::unique_ptr<updates::RangedSources> JobQueue::sources_of(const Dataset& dataset, proto::Job& job) const {
  const fs::path folder = layout_.dataset(dataset.id);
  const auto print = dataset.address.empty() ? std::nullopt : fetched_print(folder);
  std::vector<updates::RangedSource::Place> places;
  if (print && print->ranged) places.push_back({dataset.address, folder / dataset.raster, *print});
  const auto listed = print && print->list ? updates::read_listed(folder / kRasters) : std::nullopt;
  for (std::size_t k = 0; listed && k < listed->rasters.size(); ++k) {
    const updates::ListedRaster& raster = listed->rasters[k];
    const fs::path file = fs::path(kRasters) / updates::file_of(*listed, k);
    proto::SourceSpec& spec = *job.add_rasters();
    spec.set_path(file.string());
    spec.set_name(raster.name);
    *spec.mutable_options() = raster.options;
    places.push_back({raster.address, folder / file, raster.print});
  }
  job.set_vrt(listed && listed->vrt);
  const bool any = std::any_of(places.begin(), places.end(), [](const auto& place) { return place.print.ranged; });
  return any ? std::make_unique<updates::RangedSources>(fetch_.rest, std::move(places)) : nullptr;
}

}  // namespace cordillera::server
