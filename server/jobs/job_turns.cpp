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
  if (take_back(dataset)) return ledger_.first(id) ? Next::again : Next::done;
  if (!served) registry_.set_state(id, State::running, std::nullopt);
  hub_.touch(id);
  log_info("dataset " + id + ": version " + std::to_string(change->number()) + " started");
  metrics::StageClock clock(metrics_);
  forget_unfinished(turn);
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
    ledger_.note_waiting(id, change.id(), outcome.problem());
    if (take_back(dataset)) return ledger_.first(id) ? Next::again : Next::done;
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

/// Of a raster that could not be added and whose removal waits: nothing is built for either. False: there is none.
bool JobQueue::take_back(const Dataset& dataset) {
  const std::string& id = dataset.id;
  if (dataset.state != State::ready) return false;
  const auto taken = ledger_.take_back(id);
  if (!taken) throw RegistryError(taken.problem().detail);  // tried again
  if (!*taken) return false;
  ledger_.tidy(id, keep_versions_);
  metrics_.versions.add(1, {"failed"});
  log_info("dataset " + id + ": a raster that could not be added is taken back: " + (*taken)->line());
  hub_.ended(id);
  return true;
}

/// Whether the next change brings a raster that still stands at its address alone.
bool JobQueue::needs_copy(const Dataset& dataset) {
  if (dataset.state == State::failed || !ledger_.holds(dataset.id)) return false;
  const auto change = ledger_.first(dataset.id);
  return change && !change->source().url().empty() && change->source().hash().empty() &&
         !updates::is_done(layout_, dataset.id, *change);
}

/// A host that is slow holds no turn of a build. Clients take turns here, too.
void JobQueue::copy_first(const Turn& turn) {
  if (copy_turns_.add(turn)) boost::asio::post(copies_, [this] { copy_next(); });
}

void JobQueue::copy_next() {
  const auto turn = copy_turns_.next();
  if (!turn) return;
  try {
    if (!copy(*turn)) return;
    enqueue(turn->id, turn->client);
    hub_.touch(turn->id);
  } catch (const std::exception& error) {  // the registry's, or want of memory
    log_warning("dataset " + turn->id + ": " + error.what() + "; its raster is copied later");
    retry_later(*turn);
  }
}

/// False: the change has come to its end with that, or is tried again.
bool JobQueue::copy(const Turn& turn) {
  const auto flag = begin(turn.id, Work::fetch);
  if (!flag) return later(kLookAgain, turn), false;
  const Row dataset = registry_.find(turn.id);
  if (!dataset || !needs_copy(*dataset)) return dataset != nullptr;
  const auto change = ledger_.first(turn.id);
  const LogScope job("job", turn.id), request("request", change->request_id());
  tell_fetching(turn.id);
  const auto copied = copy_source(turn.id, *change, *flag);
  if (*flag) return false;
  if (!copied && settle(*dataset, *change, copied.problem(), turn) == Next::again) enqueue({turn.id, turn.client, 0});
  return copied.ok();
}

proto::Result<void> JobQueue::copy_source(const std::string& id, proto::SourceChange change, const std::atomic<bool>& stop) {
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
  const std::string version = "dataset " + id + ": version " + std::to_string(change.number());
  if (outcome)
    log_info(version + " is served");
  else
    log_warning(version + " failed: " + outcome.problem().line());
  hub_.ended(id);
}

}  // namespace cordillera::server
