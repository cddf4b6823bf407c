// The queue's part that runs jobs: what a child is told, what it may take, and once more where that may help.
#include <algorithm>
#include <fstream>

#include "server/datasets/upload.h"
#include "server/http/json.h"
#include "server/jobs/job_queue.h"
#include "server/jobs/turn.h"
#include "server/jobs/underway.h"
#include "server/limits/disk.h"
#include "server/log/log.h"
#include "server/metrics/stage_clock.h"

namespace cordillera::server {
namespace {

proto::Problem stopped() { return {"service-stopping", "the service is stopping", "trying again later", ""}; }

}  // namespace

bool write_job(const std::filesystem::path& folder, const proto::Job& job) {
  std::ofstream file(folder / kJobFile);
  file << to_json_line(job) << '\n';
  file.close();
  return file.good();
}

proto::Problem cannot_write_job(const std::filesystem::path& folder) {
  return {"storage-full", "cannot write into the folder of " + folder.filename().string(), "", ""};
}

std::uint64_t bytes_of_rasters(const std::filesystem::path& folder, const proto::Job& job) {
  std::error_code error;
  std::uint64_t bytes = 0;
  const auto add = [&](const std::filesystem::path& file) {
    const std::uint64_t there = limits::bytes_on_disk(file);
    bytes += std::min(there, sent_bytes(file).value_or(there));
  };
  if (!job.raster().empty()) add(folder / job.raster());
  for (const proto::JobRaster& raster : job.rasters()) add(folder / raster.path());
  for (const auto& entry : std::filesystem::directory_iterator(folder / updates::kSources, error)) add(entry.path());
  return bytes;
}

std::uint32_t build_seconds(const Limits& limits, std::uint64_t raster_bytes) {
  const std::uint64_t mib = (raster_bytes >> 20) + 1;
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(limits.build_seconds, limits.build_base_seconds + mib * limits.build_seconds_per_mib));
}

proto::Job job_of(const Dataset& dataset) {
  proto::Job job;
  job.set_id(dataset.id);
  job.set_name(dataset.name);
  job.set_request_id(dataset.request_id);
  *job.mutable_options() = dataset.options;
  job.set_provisional(!dataset.options.has_provisional() || dataset.options.provisional());
  job.set_lazy(is_lazy(dataset));
  // No part of what is built.
  job.mutable_options()->clear_provisional();
  job.mutable_options()->clear_build();
  return job;
}

/// Of a build that the service ended with again and again: what it comes to.
std::optional<JobQueue::Next> JobQueue::refuse_deadly(const Dataset& dataset, const Turn& turn) {
  const std::filesystem::path folder = layout_.dataset(dataset.id);
  if (unsaid_ends(folder) < kMostUnsaidEnds) return std::nullopt;
  const Outcome crashed = proto::Problem{"job-crashed",
                                         "the service was killed " + std::to_string(kMostUnsaidEnds) +
                                             " times while this was built, and nothing of it was "
                                             "done in between: it may need more memory than the service has",
                                         "a smaller raster, more memory for the service, or posting it again", ""};
  forget_unsaid_ends(folder);
  if (const auto change = ledger_.holds(dataset.id) ? ledger_.first(dataset.id) : std::nullopt)
    return settle(dataset, *change, crashed, turn);
  if (dataset.state == State::queued || dataset.state == State::running) finish(dataset, crashed);
  return Next::done;
}

/// The service may have ended for another build that ran beside this one. So of those that would fail with the next end one runs
/// at a time. Null: one does.
std::shared_ptr<void> JobQueue::last_try(const std::string& id) {
  if (unsaid_ends(layout_.dataset(id)) + 1 < kMostUnsaidEnds) return std::make_shared<int>();
  if (last_try_.exchange(true)) return nullptr;
  return {this, [](void* queue) { static_cast<JobQueue*>(queue)->last_try_ = false; }};
}

/// A look at a raster whose build waits for others: steps of provisional tiles. Who shows some gives way to who shows none.
JobQueue::Next JobQueue::look_at(const std::string& id) {
  const auto flag = begin(id, Work::look);
  const Row dataset = flag ? registry_.find(id) : nullptr;
  if (!dataset || dataset->state != State::queued) return Next::done;
  if (ledger_.holds(id)) {  // the rasters of the first version; what has an address has not come yet
    const auto change = ledger_.first(id);
    if (!change || change->source().hash().empty() || !updates::prepare(layout_, id, *change)) return Next::done;
  }
  proto::Job job = job_of(*dataset);
  job.set_raster(dataset->raster);
  job.set_dry_run(true);
  const std::filesystem::path folder = layout_.dataset(id);
  if (unsaid_ends(folder) > 0) return Next::done;  // one look more than its build would be one end more
  const auto rasters = sources_of(*dataset, job);
  limit(job, folder);
  if (!write_job(folder, job)) return Next::done;
  const LogScope about("job", id);
  ProgressSink shown = [&](const proto::Progress& now) {
    if (!now.provisional()) return;
    show_provisional(id), hub_.touch(id);
    const std::lock_guard lock(mutex_);
    running_.at(id).shows = true;
    if (first_looks_ > 0 && now.done() < now.total()) give_way(running_.at(id));
  };
  shown.rasters = rasters.get();
  const auto outcome = runner_(folder, shown, *flag);
  if (gave_way(id)) return Next::again;
  if (!outcome && !*flag)
    log_info("dataset " + id + ": no first look: " + outcome.problem().line());  // its build will say so to whoever posted it
  return Next::done;
}

proto::Result<std::optional<proto::Estimate>> JobQueue::build(const Dataset& dataset, metrics::StageClock& clock,
                                                              const std::atomic<bool>& stop) {
  const auto folder = layout_.dataset(dataset.id);
  std::error_code ignored;
  if (!std::filesystem::exists(folder / dataset.raster, ignored)) {
    return proto::Problem{"internal", "the raster of " + dataset.name + " is no longer in the data folder", "posting it again",
                          ""};
  }
  proto::Job job = job_of(dataset);
  job.set_raster(dataset.raster);
  const auto rasters = sources_of(dataset, job);
  return run_job(folder, std::move(job), {clock, stop, rasters.get()});
}

JobQueue::Outcome JobQueue::run_job(const std::filesystem::path& folder, proto::Job job, const Circumstances& around) {
  const std::string id = job.id();
  const std::atomic<bool>& stop = around.stop;
  ProgressSink progress = [&](const proto::Progress& now) {
    if (now.provisional()) show_provisional(id);
    around.clock.report(now);
    hub_.publish(id, now);
  };
  progress.rasters = around.rasters;
  limit(job, folder);
  if (!write_job(folder, job)) return cannot_write_job(folder);
  if (job.lazy()) {
    std::error_code error;
    std::filesystem::remove(folder / kOthersWaitFile, error);
    {
      const std::lock_guard lock(mutex_);
      if (const auto running = running_.find(id); running != running_.end()) running->second.lazy = true;
    }
    tell_who_waits();
  }
  auto outcome = runner_(folder, progress, stop);
  if (!outcome && outcome.problem().type == "job-crashed" && !stop) {
    // Once: the machine may have run out of memory, or somebody ended it. What was committed stays, and the job goes on there.
    log_warning("dataset " + id + ": " + outcome.problem().detail + "; once more");
    // Not the provisional tiles, though: they may be what it was ended for.
    job.set_provisional(false);
    if (!write_job(folder, job)) return cannot_write_job(folder);
    outcome = runner_(folder, progress, stop);
  }
  if (!outcome && !stop && has_more_time(outcome.problem(), folder, job, around)) {
    log_info("dataset " + id + ": its time is over, and more of its raster has come since it began: it goes on in another turn");
    return proto::Problem{"paused", "the build has more time than it was told", "", "turn"};
  }
  if (outcome || outcome.problem().type != "device-lost" || stop) return outcome;
  log_warning("dataset " + id + ": " + outcome.problem().detail + "; once more on the CPU");
  metrics_.device_lost.add(1);
  job.mutable_options()->set_device("cpu");
  if (!write_job(folder, job)) return cannot_write_job(folder);
  return runner_(folder, progress, stop);
}

/// Of a raster that is read by ranges hardly anything is there when the job is told its time. What came since has its time, too:
/// at most as often as that grows, which the operator's own bound ends.
bool JobQueue::has_more_time(const proto::Problem& why, const std::filesystem::path& folder, const proto::Job& job,
                             const Circumstances& around) const {
  return why.type == "build-time-limit" && around.rasters != nullptr &&
         build_seconds(limits_, bytes_of_rasters(folder, job)) > job.max_seconds();
}

void JobQueue::limit(proto::Job& job, const std::filesystem::path& folder) const {
  job.set_max_pixels(limits_.megapixels * 1e6);
  job.set_max_side(limits_.side);
  job.set_max_seconds(build_seconds(limits_, bytes_of_rasters(folder, job)));
}

proto::Result<proto::Estimate> JobQueue::dry_run(const std::filesystem::path& folder, const std::string& client,
                                                 const proto::Job& asked) {
  proto::Job job = asked;
  limit(job, folder);
  const auto turn = dry_turns_.take(folder.filename().string(), client);
  if (!turn) return stopped();
  const auto outcome = write_job(folder, job) ? runner_(folder, nullptr, stopping_)
                                              : proto::Result<std::optional<proto::Estimate>>(cannot_write_job(folder));
  if (!outcome && outcome.problem().type == "cancelled") return stopped();
  if (!outcome) return outcome.problem();
  if (!*outcome) return proto::Problem{"internal", "the dry run gave no estimate", "", ""};
  return **outcome;
}

}  // namespace cordillera::server
