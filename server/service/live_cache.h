#pragma once
// What the service keeps although nobody told it to: rasters that it has fetched by itself, and blocks that it has made because
// somebody looked. Both can be had again, so the disk that they take has a limit, and what was read longest ago goes first.
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "server/datasets/registry.h"
#include "server/fetch/fetch.h"
#include "server/jobs/job_queue.h"
#include "server/limits/admission.h"
#include "server/metrics/service_metrics.h"

namespace cordillera::server {

/// Thread-safe. A dataset whose things have gone is asleep: it is running, has a row and an address, and one that was posted its
/// raster; who reads it wakes it.
class LiveCache {
 public:
  struct Parts {
    Layout layout;
    Registry& registry;
    JobQueue& queue;
    limits::Admission& admission;
    metrics::ServiceMetrics& metrics;
    updates::Ask ask;
    std::uint64_t most_bytes = 0;  ///< 0: no limit
    std::uint32_t most_queued = 0;
    std::function<void(const std::string& id)> changed;  ///< other files are there
    std::chrono::seconds fresh{60};                      ///< so long an address is not asked again, nor what failed tried again
  };
  explicit LiveCache(Parts parts);

  /// The dataset of an address with these options, as key names both; null: there is none.
  Row find(const std::string& key);
  /// The same; if there is none, what make gives, which is in the registry by then. Nobody makes another one meanwhile.
  proto::Result<Row> find_or_make(const std::string& key, const std::function<proto::Result<Row>()>& make);
  /// Takes a place of a client, until the dataset's raster is there. Problems: those of Admission.
  proto::Result<limits::Slot> enter(const std::string& client);
  void hold(const std::string& id, limits::Slot place);
  /// The dataset with an address that was not read for the longest time; null: all are in use.
  Row oldest() const;

  /// Somebody is about to read the dataset. Wakes it, and asks its address now and then. True: nothing is there of it yet, but it
  /// comes.
  bool note_read(const Dataset& dataset, const std::string& client);
  bool is_asleep(const std::string& id) const;
  /// Something was made of a dataset, or it ended.
  void touch();
  std::uint64_t bytes() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Entry {
    Clock::time_point read{}, asked{}, begun{};  ///< when, and when its raster was last sent for
    bool asleep = false, woken = false;
    bool is_to_be_asked = false;  ///< its address: it waits for its turn, or is asked now
    int next_listed = 0;          ///< of the rasters that a list names: the next that is asked for again
    limits::Slot place;
  };
  struct Kept {
    Row row;
    std::uint64_t bytes = 0;
  };
  bool is_kept(const Dataset& dataset) const;
  std::uint64_t bytes_of(const Dataset& dataset) const;
  void wake(const Dataset& dataset, const std::string& client);
  void release_places();
  std::uint64_t trim();
  bool put_to_sleep(const Dataset& dataset);
  void forget_files(const Dataset& dataset) const;
  void keep_within(const std::stop_token& stop);
  void ask_addresses(const std::stop_token& stop);
  void ask_address(const std::string& id, const std::stop_token& stop);
  updates::Still ask_listed(const std::string& id, const std::stop_token& stop);

  const Parts parts_;
  std::mutex making_;  ///< one dataset after the other
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::map<std::string, std::string> ids_;  ///< by key
  std::map<std::string, Entry> entries_;    ///< by id
  /// Each once. Of a host that is being asked none is: one that does not answer keeps a thread, and not all of them.
  std::deque<std::pair<std::string, std::string>> to_ask_;  ///< ids, and their hosts
  std::set<std::string> asked_hosts_;
  bool touched_ = true;
  std::uint64_t bytes_ = 0;
  std::jthread keeping_;  ///< last: they work on what is above, and end before it
  std::array<std::jthread, 4> asking_;
};

}  // namespace cordillera::server
