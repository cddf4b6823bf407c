#include "server/job_queue.h"

#include <boost/asio/post.hpp>
#include <fstream>

#include "server/json.h"
#include "server/log.h"

namespace cordillera::server {
namespace {

bool write_job(const std::filesystem::path& folder, const proto::Job& job) {
  std::ofstream file(folder / kJobFile);
  file << to_json_line(job) << '\n';
  file.close();
  return file.good();
}

proto::Problem stopped() { return {"service-stopping", "the service is stopping", "trying again later", ""}; }

proto::Problem cannot_write(const std::filesystem::path& folder) {
  return {"storage-full", "cannot write into the folder of " + folder.filename().string(), "", ""};
}

}  // namespace

JobQueue::JobQueue(Layout layout, Registry& registry, ProgressHub& hub, JobRunner runner, unsigned concurrency)
    : layout_(std::move(layout)), registry_(registry), hub_(hub), runner_(std::move(runner)), dry_runs_free_(concurrency),
      pool_(concurrency) {}

JobQueue::~JobQueue() { stop(); }

void JobQueue::resume() {
  const auto all = registry_.list();
  for (auto dataset = all.rbegin(); dataset != all.rend(); ++dataset) {
    if (dataset->state != State::queued && dataset->state != State::running) continue;
    log_info("dataset " + dataset->id + " was unfinished: queued again");
    registry_.set_state(dataset->id, State::queued, std::nullopt);
    enqueue(dataset->id);
  }
}

void JobQueue::enqueue(const std::string& id) {
  boost::asio::post(pool_, [this, id] { run(id); });
}

void JobQueue::cancel(const std::string& id) {
  std::unique_lock lock(mutex_);
  const auto found = running_.find(id);
  if (found == running_.end()) return;
  *found->second = true;
  ended_.wait(lock, [&] { return running_.count(id) == 0; });
}

void JobQueue::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    for (auto& [id, flag] : running_) *flag = true;
  }
  ended_.notify_all();
  pool_.stop();
  pool_.join();
}

void JobQueue::run(const std::string& id) {
  const auto flag = std::make_shared<std::atomic<bool>>(false);
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) return;
    running_[id] = flag;
  }
  // Deleting takes the row away first: either it is gone here, or the delete finds this job in running_.
  if (const auto dataset = registry_.find(id)) {
    registry_.set_state(id, State::running, std::nullopt);
    hub_.touch(id);
    log_info("dataset " + id + ": build started");
    const auto outcome = build(*dataset, *flag);
    if (!*flag) finish(*dataset, outcome);
  }
  {
    const std::lock_guard lock(mutex_);
    running_.erase(id);
  }
  ended_.notify_all();
}

proto::Result<std::optional<proto::Estimate>> JobQueue::build(const Dataset& dataset, const std::atomic<bool>& stop) {
  const auto folder = layout_.dataset(dataset.id);
  const auto progress = [&](const proto::Progress& now) { hub_.publish(dataset.id, now); };
  proto::Job job;
  job.set_id(dataset.id);
  job.set_name(dataset.name);
  job.set_raster(dataset.raster);
  *job.mutable_options() = dataset.options;
  if (!write_job(folder, job)) return cannot_write(folder);
  auto outcome = runner_(folder, progress, stop);
  if (outcome || outcome.problem().type != "device-lost" || stop) return outcome;
  log_warning("dataset " + dataset.id + ": " + outcome.problem().detail + "; once more on the CPU");
  job.mutable_options()->set_device("cpu");
  if (!write_job(folder, job)) return cannot_write(folder);
  return runner_(folder, progress, stop);
}

void JobQueue::finish(const Dataset& dataset, const proto::Result<std::optional<proto::Estimate>>& outcome) {
  std::error_code ignored;
  const auto folder = layout_.dataset(dataset.id);
  if (outcome) {
    registry_.set_state(dataset.id, State::ready, std::nullopt);
    log_info("dataset " + dataset.id + ": ready");
  } else {
    registry_.set_state(dataset.id, State::failed, outcome.problem());
    // A child that was ended leaves more than the store: its log, and what drivers put beside their files.
    std::filesystem::remove_all(folder, ignored);
    log_warning("dataset " + dataset.id + ": failed: " + outcome.problem().line());
  }
  // Nothing reads the raster again, and it may be large.
  std::filesystem::remove(folder / dataset.raster, ignored);
  std::filesystem::remove(folder / kJobFile, ignored);
  hub_.touch(dataset.id);
}

proto::Result<proto::Estimate> JobQueue::dry_run(const std::filesystem::path& folder, const proto::Job& job) {
  {
    std::unique_lock lock(mutex_);
    ended_.wait(lock, [&] { return stopping_ || dry_runs_free_ > 0; });
    if (stopping_) return stopped();
    --dry_runs_free_;
  }
  auto outcome = write_job(folder, job) ? runner_(folder, nullptr, stopping_)
                                        : proto::Result<std::optional<proto::Estimate>>(cannot_write(folder));
  {
    const std::lock_guard lock(mutex_);
    ++dry_runs_free_;
  }
  ended_.notify_all();
  if (!outcome && outcome.problem().type == "cancelled") return stopped();
  if (!outcome) return outcome.problem();
  if (!*outcome) return proto::Problem{"internal", "the dry run gave no estimate", "", ""};
  return **outcome;
}

}  // namespace cordillera::server
