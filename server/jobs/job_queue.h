#pragma once
// Builds, a bounded number at a time; clients take turns. The registry remembers what is unfinished over a restart.
#include <atomic>
#include <boost/asio/thread_pool.hpp>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "server/data/layout.h"
#include "server/datasets/ledger.h"
#include "server/datasets/progress_hub.h"
#include "server/datasets/registry.h"
#include "server/fetch/fetch.h"
#include "server/fetch/listed_rasters.h"
#include "server/jobs/build_turns.h"
#include "server/jobs/child.h"
#include "server/jobs/looked_at.h"
#include "server/metrics/service_metrics.h"
#include "server/options/options.h"

namespace cordillera::server {

namespace metrics {
class StageClock;
}

/// Removes everything but the store and its record from the folder of a dataset that is ready. Nothing reads the raster again,
/// and it may be large; a child that was killed leaves other files, too.
void keep_store_alone(const std::filesystem::path& folder);

/// Datasets that have failed are kept to be asked about. Of more than these the oldest go.
inline constexpr std::size_t kMostFailed = 1000;

/// What is the disk's or the system's fault and not the raster's: the upload was accepted, so the build waits for better days.
/// attempt: how many were in vain.
bool is_passing(const proto::Problem& problem, int attempt);

/// Of all rasters that a job may read, as far as they are there.
std::uint64_t bytes_of_rasters(const std::filesystem::path& folder, const proto::Job& job);

/// What a build of rasters of so many bytes may take: one that is cheap to send keeps the others waiting for so long at most.
std::uint32_t build_seconds(const Limits& limits, std::uint64_t raster_bytes);

/// build=lazy: blocks are made as their tiles are asked for; build=full: all of them at once.
inline constexpr const char *kLazy = "lazy", *kFull = "full";
bool is_lazy(const Dataset& dataset);

/// What a child is told of a dataset, but for its raster and the operator's limits.
proto::Job job_of(const Dataset& dataset);

/// The client whose turn a build takes when no request asks for it.
inline std::string owner_of(const Dataset& dataset) { return dataset.owner.empty() ? "" : "token " + dataset.owner; }

/// How the raster that was fetched into this folder is told from a changed one; none where nothing was fetched, or the note is
/// lost.
std::optional<updates::Print> fetched_print(const std::filesystem::path& folder);

/// Of what stands at an address and is to be kept as a raster: it is a list of some. nullopt: it is none.
std::optional<proto::Problem> refuse_list(const std::filesystem::path& file, const std::string& name);

/// Into its folder. False: it cannot be written.
bool write_job(const std::filesystem::path& folder, const proto::Job& job);
proto::Problem cannot_write_job(const std::filesystem::path& folder);

class JobQueue {
 public:
  struct Parts {
    Layout layout;
    Registry& registry;
    ProgressHub& hub;
    metrics::ServiceMetrics& metrics;
    JobRunner runner;
    Limits limits;  ///< of each job
    updates::Ledger& ledger;
    updates::Fetch fetch;  ///< of rasters that are named by their address
    std::size_t keep_versions = 1;
    std::function<void(const std::string& id)> published;  ///< another version is served, or none any more
  };
  JobQueue(Parts parts, unsigned concurrency);
  ~JobQueue();

  /// Queues again whatever a former process left unfinished, oldest first.
  void resume();
  /// client: who asked for it.
  void enqueue(const std::string& id, const std::string& client);
  /// Ends a running build and returns when it has ended. Remove the dataset from the registry first: then it can't start any
  /// more.
  void cancel(const std::string& id);
  /// Fetches the raster of a dataset that has an address once more and builds anew. What was built is served until the raster is
  /// there.
  void fetch_anew(const std::string& id);
  /// Does something to a dataset's files while nothing is built of them, nor is to be. False: something is.
  bool while_idle(const std::string& id, const std::function<void()>& work);
  /// Which of those that wait it is, 1 for the next; nullopt: it does not wait, or for its own build alone.
  std::optional<std::size_t> place(const std::string& id) const;
  /// Somebody has asked for tiles of the lattice, and got what is shown of the dataset while it is built: their blocks are made
  /// next, or at all. who: waits where somebody waits for the final tiles. The job is told at once then, as of a lazy dataset
  /// always: once of all of them.
  enum class Who : std::uint8_t { passes, waits };
  void look(const Dataset& dataset, std::vector<proto::TileAddress> tiles, const proto::Manifest& shown, Who who = Who::passes);
  /// The same of somebody who waits for them since: nothing, unless so many others have looked elsewhere that this look is
  /// forgotten.
  void look_again(const Dataset& dataset, std::vector<proto::TileAddress> tiles, const proto::Manifest& shown);
  /// Somebody wants what is made of all of a lazy dataset of which something is shown. All blocks are made, behind those that
  /// others look at; a minute after the last one has asked no further ones are begun.
  void look_at_all(const Dataset& dataset);
  /// What a build of the raster in this folder would make; waits for its client's turn beside the builds.
  proto::Result<proto::Estimate> dry_run(const std::filesystem::path& folder, const std::string& client, const proto::Job& asked);
  std::size_t waiting_dry_runs() const { return dry_turns_.waiting(); }
  /// Ends running builds; their datasets stay unfinished in the registry.
  void stop();

 private:
  using Turn = BuildTurns::Entry;
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kLookAgain{200};
  enum class Work { build, fetch, look, apart };
  struct Running {
    std::atomic<bool>* stop = nullptr;
    Work work = Work::build;
    bool lazy = false;       ///< it may only wait for looks
    bool looked_at = false;  ///< a tile whose block is not done, since it began
    bool pauses = false;     ///< it will not be told of others
    bool shows = false;      ///< a look: there are tiles
    bool gives_way = false;  ///< it is ended for others, and goes on behind them
  };
  /// The stop flag of a job of this dataset, which runs until the last copy goes; null: another runs, or all are to end.
  std::shared_ptr<std::atomic<bool>> begin(const std::string& id, Work work);
  void end_look(const std::string& id);
  void wake(const Dataset& dataset);
  enum class Next { done, again };  ///< again: the dataset has more to do, at the end of the queue
  bool fetch_ahead(const std::string& id);
  void look_ahead(const std::string& id);
  static void give_way(Running& job);
  void give_way_if_slow(const std::string& id, std::chrono::nanoseconds waited);
  bool gave_way(const std::string& id);
  Next look_at(const std::string& id);
  void show_provisional(const std::string& id);
  void first_tiles(const std::string& id, const char* kind);
  void forget_posted(const std::string& id);
  void enqueue(Turn turn);
  void serve_next();
  void tell_who_waits();                   ///< to jobs that may only wait for looks
  void ask_to_end(const std::string& id);  ///< the same of one
  void say_others_wait(const std::string& id, const Running& job) const;
  void retry_later(Turn turn);  ///< one attempt more
  static std::chrono::seconds wait_before(int attempt);
  Next run(const Turn& turn);
  void tell_fetching(const std::string& id);
  std::optional<Next> have_raster(const Dataset& dataset, const Turn& turn, const std::atomic<bool>& stop);
  proto::Result<void> fetch_raster(const Dataset& dataset, const std::atomic<bool>& stop);
  /// What came from a dataset's address, and where it lies in its folder.
  struct Fetched {
    std::filesystem::path file;     ///< the raster, or the list
    std::filesystem::path rasters;  ///< the folder of those that the list names
    updates::Print print;
    std::optional<proto::ListedRasters> listed;
  };
  proto::Result<Fetched> fetch_next(const Dataset& dataset, bool as_whole, const std::atomic<bool>& stop);
  std::optional<proto::Problem> look_at_next(const Dataset& dataset, const Fetched& next, const std::atomic<bool>& stop);
  proto::Result<void> take_next(const Dataset& dataset, const Fetched& next);
  void drop_next(const Dataset& dataset) const;
  bool has_raster(const Dataset& dataset) const;
  std::filesystem::path next_rasters(const std::string& id) const;
  // Of a list of rasters that stands at an address in place of one.
  proto::Result<std::optional<proto::ListedRasters>> take_list(const Dataset& dataset, const std::filesystem::path& file,
                                                               const std::atomic<bool>& stop);
  proto::Result<proto::ListedRasters> read_list(const Dataset& dataset, proto::Job job, const std::atomic<bool>& stop);
  proto::Result<void> begin_listed(proto::ListedRasters& listed, const std::string& name, const std::filesystem::path& folder,
                                   const std::atomic<bool>& stop) const;
  std::unique_ptr<updates::RangedSources> sources_of(const Dataset& dataset, proto::Job& job);
  std::unique_ptr<updates::RangedSources> sources_of(const Dataset& dataset, const Fetched& fetched, proto::Job& job);
  std::optional<Next> fetch_again(const Dataset& dataset, const proto::Problem& why, const Turn& turn);
  enum class Paused : std::uint8_t { nobody_looks, turn_is_over };
  static Paused why_paused(const proto::Problem& of_job) {
    return of_job.parameter == "turn" ? Paused::turn_is_over : Paused::nobody_looks;
  }
  Next pause(const Dataset& dataset, Paused why);
  bool waits_for_looks(const Dataset& dataset) const;
  bool waits_for_readers(const Dataset& dataset) const;
  void forget_unfinished(const Turn& turn);
  void finish(const Dataset& dataset, const proto::Result<std::optional<proto::Estimate>>& outcome);
  void note_failed(const std::string& id);
  std::vector<Row> all_failed();
  void forget_oldest_failed();
  std::optional<Next> refuse_deadly(const Dataset& dataset, const Turn& turn);
  std::shared_ptr<void> last_try(const std::string& id);
  using Outcome = proto::Result<std::optional<proto::Estimate>>;
  struct Circumstances {
    metrics::StageClock& clock;
    const std::atomic<bool>& stop;
    updates::RangedSources* rasters = nullptr;  ///< as in ProgressSink
  };
  Outcome run_job(const std::filesystem::path& folder, proto::Job job, const Circumstances& around);
  bool has_more_time(const proto::Problem& why, const std::filesystem::path& folder, const proto::Job& job,
                     const Circumstances& around) const;
  void later(std::chrono::milliseconds wait, const Turn& turn);
  void come_back(const Turn& turn);
  void stand_still(std::chrono::milliseconds longest);
  // Of datasets whose rasters can be changed: one change, then the others' turns.
  Next take_change(const Dataset& dataset, const Turn& turn, const std::atomic<bool>& stop);
  bool needs_copy(const Dataset& dataset);
  void copy_first(const Turn& turn);
  void copy_next();
  bool copy(const Turn& turn);
  proto::Result<void> copy_source(const std::string& id, proto::SourceChange change, const std::atomic<bool>& stop);
  Outcome take_turn(const Dataset& dataset, const proto::SourceChange& change, metrics::StageClock& clock,
                    const std::atomic<bool>& stop);
  Next settle(const Dataset& dataset, const proto::SourceChange& change, const Outcome& outcome, const Turn& turn);
  void end_turn(const Dataset& dataset, const proto::SourceChange& change, const Outcome& outcome);
  bool take_back(const Dataset& dataset);
  proto::Result<std::optional<proto::Estimate>> build(const Dataset& dataset, metrics::StageClock& clock,
                                                      const std::atomic<bool>& stop);

  void limit(proto::Job& job, const std::filesystem::path& folder) const;

  Layout layout_;
  LookedAt looked_at_;
  Registry& registry_;
  ProgressHub& hub_;
  metrics::ServiceMetrics& metrics_;
  JobRunner runner_;
  Limits limits_;
  updates::Ledger& ledger_;
  updates::Fetch fetch_;
  std::size_t keep_versions_;
  std::function<void(const std::string& id)> published_;
  mutable std::mutex mutex_;
  std::condition_variable ended_;
  std::map<std::string, Running> running_;           ///< by id, as long as begin()'s flag lives
  unsigned first_looks_ = 0;                         ///< that wait: at rasters of which nothing is shown
  std::set<std::string> anew_;                       ///< ids whose rasters are to be fetched again
  std::set<std::string> as_whole_;                   ///< those of them that are not fetched by ranges then
  std::atomic<bool> last_try_{false};                ///< one is under way
  std::map<std::string, Clock::time_point> posted_;  ///< those of this process that show nothing yet
  std::deque<std::string> failed_lately_;            ///< ids, the last one at the end; kMostFailed at most
  std::atomic<bool> stopping_{false};
  const unsigned concurrency_;
  std::atomic<unsigned> unfinished_{0};  ///< turns that wait or run
  DryTurns dry_turns_;
  BuildTurns turns_;
  BuildTurns copy_turns_;
  boost::asio::thread_pool copies_;   ///< of rasters from their addresses, before their builds' turns
  boost::asio::thread_pool fetches_;  ///< of rasters whose builds wait
  boost::asio::thread_pool looks_;    ///< at rasters whose builds wait: one at a time
  boost::asio::thread_pool pool_;     ///< last: its threads use the rest
};

}  // namespace cordillera::server
