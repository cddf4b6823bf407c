// The queue's part that serves datasets whose rasters can be changed: a change a turn, each a version of its own or a problem.
#include "server/http/digest.h"
#include "server/jobs/job_queue.h"
#include "server/jobs/turn.h"
#include "server/log/log.h"
#include "server/metrics/stage_clock.h"

namespace cordillera::server {

namespace fs = std::filesystem;

JobQueue::Next JobQueue::take_change(const Dataset& dataset, const Turn& turn, const std::atomic<bool>& stop) {
  const std::string& id = dataset.id;
  const bool served = dataset.state == State::ready;
  const auto change = ledger_.first(id);
  if (!change) return Next::done;
  if (!served) registry_.set_state(id, State::running, std::nullopt);
  hub_.touch(id);
  log_info("dataset " + id + ": version " + std::to_string(change->number()) + " started");
  metrics::StageClock clock(metrics_);
  const Outcome outcome = take_turn(dataset, *change, clock, stop);
  const bool paused = !outcome && outcome.problem().type == "paused";
  clock.end(stop ? "cancelled" : outcome ? "ready" : paused ? "paused" : "failed");
  return stop ? Next::done : settle(dataset, *change, outcome, turn);
}

/// What comes of a change that has had its turn, or whose raster could not be fetched.
JobQueue::Next JobQueue::settle(const Dataset& dataset, const proto::SourceChange& change, const Outcome& outcome,
                                const Turn& turn) {
  const std::string& id = dataset.id;
  const bool served = dataset.state == State::ready;
  if (!outcome && outcome.problem().type == "paused") return pause(dataset, why_paused(outcome.problem()));
  if (!outcome && is_passing(outcome.problem(), turn.attempt)) {
    if (!served) registry_.set_state(id, State::queued, outcome.problem());
    hub_.touch(id);
    log_warning("dataset " + id + ": " + outcome.problem().line() + "; tried again later");
    retry_later(turn);
    return Next::done;
  }
  if (!served && !outcome) {  // nothing can come of the changes behind it
    finish(dataset, outcome);
    return Next::done;
  }
  end_turn(dataset, change, outcome);
  return ledger_.first(id) ? Next::again : Next::done;
}

/// The raster that a change adds, from its address. False: the change has come to its end with that, or is tried again.
bool JobQueue::fetch_change(const Dataset& dataset, const Turn& turn, const std::atomic<bool>& stop) {
  const auto change = ledger_.first(dataset.id);
  if (!change) return false;
  if (dataset.state != State::ready) registry_.set_state(dataset.id, State::running, std::nullopt);
  tell_fetching(dataset.id);
  const auto fetched = fetch_source(dataset.id, *change, stop);
  if (stop) return false;
  if (!fetched && settle(dataset, *change, fetched.problem(), turn) == Next::again) enqueue({turn.id, turn.client, 0});
  if (!fetched) return false;
  if (dataset.state != State::ready) registry_.set_state(dataset.id, State::queued, std::nullopt);
  hub_.touch(dataset.id);
  return true;
}

proto::Result<void> JobQueue::fetch_source(const std::string& id, proto::SourceChange change, const std::atomic<bool>& stop) {
  proto::DatasetSource& source = *change.mutable_source();
  const fs::path file = layout_.dataset(id) / source.spec().path();
  if (const auto fetched = fetch_.whole(source.url(), file, stop); !fetched) return fetched.problem();
  if (auto refused = refuse_list(file, updates::listed_name(source.url()))) return *refused;
  source.set_hash(digest_of_file(file));
  std::error_code error;
  source.set_bytes(static_cast<double>(fs::file_size(file, error)));
  return ledger_.amend(id, change);
}

JobQueue::Outcome JobQueue::take_turn(const Dataset& dataset, const proto::SourceChange& change, metrics::StageClock& clock,
                                      const std::atomic<bool>& stop) {
  const std::string& id = dataset.id;
  const fs::path folder = layout_.dataset(id);
  if (updates::is_done(layout_, id, change)) return std::optional<proto::Estimate>();
  if (const auto prepared = updates::prepare(layout_, id, change); !prepared) return prepared.problem();
  proto::Job job = job_of(dataset);
  job.set_request_id(change.request_id());
  // Of the first version alone, and until another change comes: that needs all of its blocks.
  job.set_lazy(job.lazy() && dataset.state != State::ready && ledger_.pending(id) == 1);
  Outcome outcome = run_job(folder, std::move(job), {clock, stop});
  if (!outcome || stop) return outcome;
  if (const auto published = updates::publish(layout_, id, keep_versions_); !published) return published.problem();
  return outcome;
}

void JobQueue::end_turn(const Dataset& dataset, const proto::SourceChange& change, const Outcome& outcome) {
  const std::string& id = dataset.id;
  published_(id);
  if (outcome) {
    registry_.set_state(id, State::ready, std::nullopt);
    first_tiles(id, "final");
    std::error_code ignored;
    std::filesystem::remove(layout_.provisional(id), ignored);
    published_(id);  // again: somebody may have opened it meanwhile
    looked_at_.forget(id);
  }
  const auto noted = ledger_.end(id, change.id(), outcome ? std::nullopt : std::optional(outcome.problem()));
  if (!noted) throw RegistryError(noted.problem().detail);  // tried again: what is done is seen to be done
  ledger_.tidy(id, keep_versions_);
  metrics_.versions.add(1, {outcome ? "published" : "failed"});
  log_info("dataset " + id + ": version " + std::to_string(change.number()) +
           (outcome ? " is served" : " failed: " + outcome.problem().line()));
  hub_.ended(id);
}

}  // namespace cordillera::server
