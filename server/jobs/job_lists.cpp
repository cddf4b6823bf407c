// The queue's part for datasets at whose address stands no raster but a list of rasters, or a VRT of them.
#include <algorithm>
#include <chrono>
#include <fstream>

#include "pipeline/threads/workers.h"
#include "raster/mosaic/source_list.h"
#include "raster/mosaic/vrt_rasters.h"
#include "server/datasets/dataset_folder.h"
#include "server/jobs/job_queue.h"
#include "server/log/log.h"
#include "server/options/request_policy.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kAskedAtOnce = 16;  // rasters: what takes time is waiting for their servers
constexpr std::chrono::minutes kLongestAsking{10};

std::string head_of(const fs::path& file) {
  std::string head(512, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head;
}

raster::ListKind kind_of(const fs::path& file, const std::string& name) { return raster::list_kind(head_of(file), name); }

/// Whatever stands before the word: GDAL takes it for a VRT, too.
bool has_vrt(const fs::path& file) { return head_of(file).find("<VRTDataset") != std::string::npos; }

/// What the list says of a raster stands in requests and in a job's options.
std::optional<proto::Problem> refused(const updates::Fetch& fetch, const proto::ListedRaster& raster, const std::string& list) {
  const auto allowed = fetch.allowed(raster.address());
  std::optional<proto::Problem> problem = check_names(raster.options());
  if (!allowed) problem = allowed.problem();
  if (problem) problem->detail = "of " + raster.name() + ", which " + list + " names: " + problem->detail;
  return problem;
}

proto::Problem too_much(const std::string& what, const std::string& most) {
  return {"sources-invalid", "the rasters of the list " + what, most, "source"};
}

}  // namespace

std::optional<proto::Problem> refuse_list(const fs::path& file, const std::string& name) {
  const raster::ListKind kind = kind_of(file, "");  // by its bytes alone
  if (kind == raster::ListKind::none) return std::nullopt;
  return proto::Problem{
      "raster-format-unsupported",
      name +
          (kind == raster::ListKind::vrt ? " is a VRT, which names other rasters" : " is no raster, but may be a list of some"),
      "build=lazy, not updates=1, to have the rasters that it names read where they are; or each of them by POST …/sources",
      "source"};
}

/// file: what was fetched, still under another name. The rasters of a list then lie beside it, in a folder of such a name.
/// nullopt: it is a raster.
proto::Result<std::optional<proto::ListedRasters>> JobQueue::take_list(const Dataset& dataset, const fs::path& file,
                                                                       const std::atomic<bool>& stop) {
  const std::string name = updates::listed_name(dataset.address);
  const raster::ListKind kind = kind_of(file, name);
  if (kind == raster::ListKind::none) return std::optional<proto::ListedRasters>();
  proto::Job job = job_of(dataset);
  job.set_name(name);
  job.set_raster(file.filename().string());
  job.set_list(true);
  job.set_vrt(kind == raster::ListKind::vrt);
  auto listed = read_list(dataset, job, stop);
  if (!listed) return listed.problem();
  if (listed->rasters().empty()) return std::optional<proto::ListedRasters>();
  listed->set_vrt(job.vrt());
  for (proto::ListedRaster& raster : *listed->mutable_rasters()) {
    raster.set_name(updates::listed_name(raster.address()));
    raster.set_address(updates::listed_address(dataset.address, raster.address()));
    if (auto problem = refused(fetch_, raster, name)) return *problem;
  }
  log_info("dataset " + dataset.id + ": " + name + " names " + std::to_string(listed->rasters_size()) + " rasters");
  if (auto begun = begin_listed(*listed, name, next_rasters(dataset.id), stop); !begun) return begun.problem();
  return std::optional(std::move(*listed));
}

/// As it is told by a job: what a stranger wrote is read where it can do no harm.
proto::Result<proto::ListedRasters> JobQueue::read_list(const Dataset& dataset, proto::Job job, const std::atomic<bool>& stop) {
  const fs::path folder = layout_.dataset(dataset.id);
  limit(job, folder);
  job.set_max_seconds(std::min(job.max_seconds(), updates::kListSeconds));
  if (!write_job(folder, job)) return cannot_write_job(folder);
  proto::ListedRasters listed;
  std::size_t bytes = 0;
  const auto outcome = runner_(
      folder,
      [&](const proto::Progress& progress) {
        if (!progress.has_listed() || bytes > updates::kMostListed_bytes) return;
        bytes += progress.listed().ByteSizeLong();
        if (bytes <= updates::kMostListed_bytes) *listed.add_rasters() = progress.listed();
      },
      stop);
  if (!outcome && outcome.problem().type == "build-time-limit")
    return too_much("take longer to list than " + std::to_string(job.max_seconds()) + " seconds", "a plain table of them");
  if (!outcome) return outcome.problem();
  if (listed.rasters_size() > updates::kMostListed || bytes > updates::kMostListed_bytes)
    return too_much("and their options take more than 8 MiB, or are more than " + std::to_string(updates::kMostListed),
                    "a shorter list");
  return listed;
}

/// All of them, or their beginnings, into the folder. Servers have so long, and what is copied whole so much room, for all of
/// them together as for one raster.
proto::Result<void> JobQueue::begin_listed(proto::ListedRasters& listed, const std::string& name, const fs::path& folder,
                                           const std::atomic<bool>& stop) const {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return cannot_write_job(folder.parent_path());
  const auto count = static_cast<std::size_t>(listed.rasters_size());
  std::vector<std::optional<proto::Problem>> problems(count);
  std::atomic<bool> over{false};
  std::atomic<std::uint64_t> copied{0};
  const std::uint64_t most = std::uint64_t{limits_.body_mib} << 20;
  const auto end = std::chrono::steady_clock::now() + kLongestAsking;
  const auto begin = [&](std::size_t k) -> std::optional<proto::Problem> {
    proto::ListedRaster& raster = *listed.mutable_rasters(static_cast<int>(k));
    if (std::chrono::steady_clock::now() > end)
      return too_much("did not answer within ten minutes", "fewer rasters, or nearer ones");
    const fs::path file = folder / updates::file_of(listed, static_cast<int>(k));
    const auto print = fetch_.beginning(raster.address(), file, stop);
    if (!print) return print.problem();
    updates::set_print(*print, raster);
    if (listed.vrt() && has_vrt(file)) return raster::vrt_in_vrt(name, raster.name());
    std::error_code gone;
    if (!print->ranged && (copied += fs::file_size(file, gone)) > most)
      return too_much("that are not read by ranges have more than " + std::to_string(limits_.body_mib) + " MiB together",
                      "GeoTIFFs on a server that sends ranges, or fewer rasters");
    return std::nullopt;
  };
  pipeline::Workers(static_cast<unsigned>(std::min<std::size_t>(kAskedAtOnce, count))).each(count, [&](std::size_t k, unsigned) {
    if (!over && (problems[k] = begin(k))) over = true;
  });
  for (const auto& problem : problems)
    if (problem) return *problem;
  double claimed = 0;
  for (const proto::ListedRaster& raster : listed.rasters()) claimed += raster.ranged() ? raster.bytes() : 0;
  if (claimed > static_cast<double>(updates::kLargestRanged_bytes))
    return too_much("have more than 4 TiB together", "fewer or smaller rasters");
  return {};
}

/// What a job of the dataset reads as it comes; null: its rasters are there. The job is told of those that a list names.
std::unique_ptr<updates::RangedSources> JobQueue::sources_of(const Dataset& dataset, proto::Job& job) {
  const fs::path folder = layout_.dataset(dataset.id);
  const auto print = dataset.address.empty() ? std::nullopt : fetched_print(folder);
  if (!print) return nullptr;
  return sources_of(
      dataset, {folder / dataset.raster, folder / kRasters, *print, print->list ? updates::read_listed(folder) : std::nullopt},
      job);
}

std::unique_ptr<updates::RangedSources> JobQueue::sources_of(const Dataset& dataset, const Fetched& fetched, proto::Job& job) {
  const auto& listed = fetched.listed;
  std::vector<updates::RangedSource::Place> places;
  if (fetched.print.ranged) places.push_back({dataset.address, fetched.file, fetched.print});
  for (int k = 0; listed && k < listed->rasters_size(); ++k) {
    const proto::ListedRaster& noted = listed->rasters(k);
    const fs::path file = fetched.rasters.filename() / updates::file_of(*listed, k);
    proto::JobRaster& raster = *job.add_rasters();
    raster.set_path(file.string());
    raster.set_name(noted.name());
    *raster.mutable_options() = noted.options();
    raster.set_ranged(noted.ranged());
    raster.set_state(updates::state_of(noted));
    places.push_back({noted.address(), fetched.rasters / file.filename(), updates::print_of(noted)});
  }
  job.set_vrt(listed && listed->vrt());
  const bool any = std::any_of(places.begin(), places.end(), [](const auto& place) { return place.print.ranged; });
  if (!any) return nullptr;
  return std::make_unique<updates::RangedSources>(fetch_.rest, std::move(places),
                                                  [this, id = dataset.id](auto waited) { give_way_if_slow(id, waited); });
}

}  // namespace cordillera::server
