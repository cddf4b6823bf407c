#include "server/jobs/job_queue.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <fstream>

#include "pipeline/store/mesh_files.h"
#include "server/datasets/dataset_folder.h"
#include "server/jobs/underway.h"
#include "server/log/log.h"
#include "server/metrics/stage_clock.h"

namespace cordillera::server {
namespace {

constexpr auto kFirstWait = std::chrono::seconds(2), kLongestWait = std::chrono::seconds(300);
constexpr std::size_t kFetchesAhead = 2;
constexpr std::size_t kCopiesAtOnce = 4;
constexpr int kTriesWithTables = 12;   // half an hour; an installation without them stays so
constexpr int kTriesWithOneStore = 3;  // then what was built so far is thrown away: it may be what is wrong

}  // namespace

std::chrono::seconds JobQueue::wait_before(int attempt) {
  return std::min(kLongestWait, kFirstWait * (1 << std::min(attempt, 10)));
}

bool is_passing(const proto::Problem& problem, int attempt) {
  if (problem.type == "crs-tables-unreadable") return attempt < kTriesWithTables;
  return problem.type == "store-write" || problem.type == "storage-full" || problem.type == "service-busy";
}

void keep_store_alone(const std::filesystem::path& folder) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (entry.path().filename() != kStoreFile && !is_record(entry.path().filename()))
      std::filesystem::remove_all(entry.path(), ignored);
  }
}

JobQueue::JobQueue(Parts parts, unsigned concurrency)
    : layout_(std::move(parts.layout)),
      looked_at_(layout_),
      registry_(parts.registry),
      hub_(parts.hub),
      metrics_(parts.metrics),
      runner_(telling_no_places(noting_ends(std::move(parts.runner)))),
      limits_(parts.limits),
      ledger_(parts.ledger),
      fetch_(std::move(parts.fetch)),
      keep_versions_(parts.keep_versions),
      published_(std::move(parts.published)),
      concurrency_(concurrency),
      dry_turns_(concurrency),
      copies_(kCopiesAtOnce),
      fetches_(kFetchesAhead),
      looks_(1),
      pool_(concurrency) {
  // A pool takes descriptors for its clocks with the first one. When that is needed there may be none.
  const boost::asio::steady_timer first(pool_);
}

JobQueue::~JobQueue() { stop(); }

void JobQueue::resume() {
  const std::vector<Row> all = registry_.list();
  for (auto row = all.rbegin(); row != all.rend(); ++row) {
    const Row& dataset = *row;
    if (dataset->state == State::ready && ledger_.holds(dataset->id) && ledger_.first(dataset->id)) {
      log_info("dataset " + dataset->id + " has changes that were not done: queued again");
      enqueue(dataset->id, owner_of(*dataset));
    }
    if (dataset->state != State::queued && dataset->state != State::running) continue;
    if (dataset->state == State::running && (waits_for_looks(*dataset) || waits_for_readers(*dataset))) continue;
    log_info("dataset " + dataset->id + " was unfinished: queued again");
    registry_.set_state(dataset->id, State::queued, std::nullopt);
    enqueue(dataset->id, owner_of(*dataset));
  }
}

void JobQueue::enqueue(const std::string& id, const std::string& client) {
  const Row dataset = registry_.find(id);
  const bool fresh = dataset && dataset->state != State::ready, has_address = fresh && !dataset->address.empty();
  if (fresh && !has_address) {
    const std::lock_guard lock(mutex_);
    posted_.emplace(id, Clock::now());
  }
  if (dataset && needs_copy(*dataset)) return copy_first({id, client, 0});
  const bool waits = unfinished_ >= concurrency_;
  enqueue({id, client, 0});
  if (!fresh || !waits || !job_of(*dataset).provisional()) return;
  if (!has_address) return look_ahead(id);
  boost::asio::post(fetches_, [this, id] {
    try {
      if (fetch_ahead(id)) look_ahead(id);
    } catch (const std::exception& error) {  // the registry's, or want of memory; its build is tried all the same
      log_warning("dataset " + id + ": " + error.what());
    }
  });
}

void JobQueue::give_way(Running& job) {
  job.gives_way = true;
  *job.stop = true;
}

bool JobQueue::gave_way(const std::string& id) {
  const std::lock_guard lock(mutex_);
  return running_.at(id).gives_way;
}

/// A job that waits for its source keeps none of the others waiting for longer than a request would wait for a tile. What has
/// come stays: it goes on from there.
void JobQueue::give_way_if_slow(const std::string& id, std::chrono::nanoseconds waited) {
  constexpr std::uint32_t kWhereNobodyWaits_s = 10;
  const std::chrono::seconds longest(limits_.wait_seconds > 0 ? limits_.wait_seconds : kWhereNobodyWaits_s);
  if (waited < longest) return;
  const std::lock_guard lock(mutex_);
  const auto found = running_.find(id);
  if (found == running_.end() || *found->second.stop) return;
  const bool others_wait = found->second.work == Work::look ? first_looks_ > 0 : unfinished_ > concurrency_;
  if (others_wait) give_way(found->second);
}

void JobQueue::look_ahead(const std::string& id) {
  std::error_code ignored;
  const bool first = !std::filesystem::exists(layout_.provisional(id), ignored);
  if (first) {
    const std::lock_guard lock(mutex_);
    ++first_looks_;
    for (auto& [other, job] : running_)
      if (job.work == Work::look && job.shows) give_way(job);
  }
  auto waits = std::shared_ptr<void>(nullptr, [this, first](void*) {  // however the wait ends
    const std::lock_guard lock(mutex_);
    if (first) --first_looks_;
  });
  boost::asio::post(looks_, [this, id, waits]() mutable {
    waits.reset();
    try {
      if (look_at(id) == Next::again) look_ahead(id);
    } catch (const std::exception& error) {  // as in enqueue()
      log_warning("dataset " + id + ": " + error.what());
    }
  });
}

/// kind: provisional, or final where these came first.
void JobQueue::first_tiles(const std::string& id, const char* kind) {
  const std::lock_guard lock(mutex_);
  const auto posted = posted_.extract(id);
  if (posted.empty()) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - posted.mapped()).count();
  metrics_.first_tile_seconds.observe(seconds, {kind});
  log_info("dataset " + id + ": first tiles", {{"kind", std::string(kind)}, {"seconds", seconds}});
}

void JobQueue::forget_posted(const std::string& id) {
  const std::lock_guard lock(mutex_);
  posted_.erase(id);
}

void JobQueue::enqueue(Turn added) {
  if (turns_.add(std::move(added))) serve_next();
}

void JobQueue::serve_next() {
  ++unfinished_;
  tell_who_waits();
  boost::asio::post(pool_, [this, over = std::shared_ptr<void>(nullptr, [this](void*) { --unfinished_; })] {
    const auto turn = turns_.next();
    if (!turn) return;
    try {
      if (run(*turn) == Next::again) enqueue({turn->id, turn->client, 0});
    } catch (const std::exception& error) {  // the registry's, or want of memory
      log_warning("dataset " + turn->id + ": " + error.what() + "; its build is tried again");
      retry_later(*turn);
    }
  });
}

void JobQueue::tell_who_waits() {
  if (unfinished_ <= concurrency_) return;
  const std::lock_guard lock(mutex_);
  for (const auto& [id, job] : running_) say_others_wait(id, job);
}

std::optional<std::size_t> JobQueue::place(const std::string& id) const {
  {
    const std::lock_guard lock(mutex_);
    const auto found = running_.find(id);
    if (found != running_.end() && (found->second.work == Work::build || found->second.work == Work::fetch)) return std::nullopt;
  }
  return turns_.place(id);
}

void JobQueue::ask_to_end(const std::string& id) {
  const std::lock_guard lock(mutex_);
  if (const auto running = running_.find(id); running != running_.end()) say_others_wait(id, running->second);
}

void JobQueue::say_others_wait(const std::string& id, const Running& job) const {
  if (job.lazy) std::ofstream(layout_.dataset(id) / kOthersWaitFile);
}

void JobQueue::retry_later(Turn turn) {
  ++turn.attempt;
  later(wait_before(turn.attempt), turn);
}

void JobQueue::later(std::chrono::milliseconds wait, const Turn& turn) {
  try {
    auto timer = std::make_shared<boost::asio::steady_timer>(pool_, wait);
    timer->async_wait([this, timer, turn](const boost::system::error_code& error) {
      if (!error) come_back(turn);
    });
  } catch (const std::exception&) {  // want of memory: without a clock this thread waits itself
    stand_still(wait);
    come_back(turn);
  }
}

/// On a thread of the pool: an exception would end the process.
void JobQueue::come_back(const Turn& turn) {
  while (!stopping_) {
    try {
      turns_.add(turn);
      return serve_next();  // one too many finds nothing to do
    } catch (const std::exception&) { stand_still(kFirstWait); }
  }
}

void JobQueue::stand_still(std::chrono::milliseconds longest) {
  std::unique_lock lock(mutex_);
  ended_.wait_for(lock, std::min<std::chrono::milliseconds>(longest, kFirstWait), [this] { return stopping_.load(); });
}

void JobQueue::cancel(const std::string& id) {
  looked_at_.forget(id);
  std::unique_lock lock(mutex_);
  posted_.erase(id);
  const auto found = running_.find(id);
  if (found == running_.end()) return;
  *found->second.stop = true;
  ended_.wait(lock, [&] { return running_.count(id) == 0; });
}

void JobQueue::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    for (auto& [id, job] : running_) *job.stop = true;
  }
  ended_.notify_all();
  dry_turns_.stop();
  for (boost::asio::thread_pool* pool : {&copies_, &fetches_, &looks_, &pool_}) {
    pool->stop();
    pool->join();
  }
}

std::shared_ptr<std::atomic<bool>> JobQueue::begin(const std::string& id, Work work) {
  auto flag = std::make_unique<std::atomic<bool>>(false);
  // However this ends: a delete waits for it.
  auto over = [this, id](const std::atomic<bool>* ended) {
    {
      const std::lock_guard inner(mutex_);
      running_.erase(id);
    }
    delete ended;
    ended_.notify_all();
  };
  {
    const std::lock_guard lock(mutex_);
    if (stopping_ || !running_.emplace(id, Running{flag.get(), work}).second) return nullptr;
  }
  return {flag.release(), std::move(over)};
}

/// Ends a first look at this dataset's raster, if there is one: its build would lose its turn to it, and looks for itself.
void JobQueue::end_look(const std::string& id) {
  std::unique_lock lock(mutex_);
  const auto looks = [&] {
    const auto found = running_.find(id);
    return found != running_.end() && found->second.work == Work::look;
  };
  if (!looks()) return;
  *running_.at(id).stop = true;
  ended_.wait(lock, [&] { return !looks(); });
}

void JobQueue::show_provisional(const std::string& id) {
  published_(id);
  first_tiles(id, "provisional");
}

JobQueue::Next JobQueue::run(const Turn& turn) {
  const std::string& id = turn.id;
  const int attempt = turn.attempt;
  end_look(id);
  auto flag = begin(id, Work::build);
  // Another change of the same dataset is being done, or its raster is fetched, and that thread may be about to end, or only wait
  // for looks: look again soon.
  if (!flag) return ask_to_end(id), later(kLookAgain, turn), Next::done;
  // Deleting takes the row away first: either it is gone here, or the delete finds this job in running_.
  Row dataset = registry_.find(id);
  if (dataset) {
    const LogScope job("job", id), request("request", dataset->request_id);
    if (const auto ended = refuse_deadly(*dataset, turn)) return *ended;
    const auto alone = last_try(id);
    if (!alone) return flag.reset(), later(kLookAgain, turn), Next::done;
    if (const auto ended = have_raster(*dataset, turn, *flag)) return *ended;
    if (!dataset->address.empty()) dataset = registry_.find(id);
    if (!dataset) return Next::done;
    if (needs_copy(*dataset)) return flag.reset(), copy_first(turn), Next::done;
    if (ledger_.holds(id)) return take_change(*dataset, turn, *flag);
    if (dataset->state == State::ready || dataset->state == State::failed)
      return Next::done;  // an earlier turn's work: its raster is gone
    registry_.set_state(id, State::running, std::nullopt);
    hub_.touch(id);
    log_info("dataset " + id + ": build started");
    metrics::StageClock clock(metrics_);
    const bool was_out_of_reach =
        dataset->problem && dataset->problem->type == "source-unreachable";  // its store is as good as before
    if (!was_out_of_reach) forget_unfinished(turn);
    const auto outcome = build(*dataset, clock, *flag);
    const bool paused = !outcome && outcome.problem().type == "paused";
    const bool gives_way = gave_way(id);
    clock.end(paused || gives_way ? "paused" : *flag ? "cancelled" : outcome ? "ready" : "failed");
    if (gives_way) {
      log_info("dataset " + id + ": its source is slow, and others wait: they have their turn");
      return pause(*dataset, Paused::turn_is_over);
    }
    if (*flag) return Next::done;
    if (paused) return pause(*dataset, why_paused(outcome.problem()));
    if (const auto again = outcome ? std::nullopt : fetch_again(*dataset, outcome.problem(), turn)) return *again;
    if (outcome || !is_passing(outcome.problem(), attempt)) return finish(*dataset, outcome), Next::done;
    registry_.set_state(id, State::queued, outcome.problem());
    hub_.touch(id);
    log_warning("dataset " + id + ": " + outcome.problem().line() + "; tried again in " +
                std::to_string(wait_before(attempt + 1).count()) + " s");
    retry_later(turn);
  }
  return Next::done;
}

/// After some attempts in vain. Of a version that is served nothing goes.
void JobQueue::forget_unfinished(const Turn& turn) {
  if (turn.attempt == 0 || turn.attempt % kTriesWithOneStore != 0) return;
  const bool changes = ledger_.holds(turn.id);
  pipeline::remove_store((changes ? layout_.dataset(turn.id) / updates::kNextStore : layout_.store(turn.id)).string());
}

void JobQueue::finish(const Dataset& dataset, const proto::Result<std::optional<proto::Estimate>>& outcome) {
  if (outcome) {
    registry_.set_state(dataset.id, State::ready, std::nullopt);
    first_tiles(dataset.id, "final");
    log_info("dataset " + dataset.id + ": ready");
  } else {
    note_failed(dataset.id);  // before others see it
    registry_.set_state(dataset.id, State::failed, outcome.problem());
    // A child that was ended leaves more than the store: its log, and what drivers put beside their files.
    remove_dataset_folder(layout_, dataset.id);
    log_warning("dataset " + dataset.id + ": failed: " + outcome.problem().line());
  }
  if (outcome) keep_store_alone(layout_.dataset(dataset.id));
  forget_posted(dataset.id);
  looked_at_.forget(dataset.id);
  published_(dataset.id);  // after its provisional tiles have gone, which else somebody might open again
  hub_.ended(dataset.id);
  if (!outcome) forget_oldest_failed();
}

}  // namespace cordillera::server
