#pragma once
// Whose build is next: clients take turns, so that one who posts a hundred rasters, or changes one a hundred times, delays
// another's by one.
#include <condition_variable>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace cordillera::server {

/// Thread-safe.
class BuildTurns {
 public:
  struct Entry {
    std::string id;      ///< of the dataset
    std::string client;  ///< who asked for it
    int attempt = 0;     ///< how often the disk has been in the way before
    int unreached = 0;   ///< how often the raster's address could not be reached
    int replaced = 0;    ///< how often it had another raster
  };
  /// At the end of its client's. False: the dataset waits already, and stays where it is.
  bool add(Entry entry);
  /// The first of the client whose turn it is.
  std::optional<Entry> next();
  /// 1 for the one that is next; nullopt: it does not wait.
  std::optional<std::size_t> place(const std::string& id) const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::deque<Entry>> waiting_;  ///< by client; none is empty
  std::list<std::string> turns_;                      ///< the clients in it, each once
  std::map<std::string, std::string> clients_;        ///< by dataset
};

/// Dry runs, a bounded number at a time, in the same order. Thread-safe.
class DryTurns {
 public:
  explicit DryTurns(unsigned most) : free_(most) {}
  /// Waits for a turn, which ends with what is returned. Null: all are to end. id: another's than of those that wait.
  std::shared_ptr<void> take(const std::string& id, const std::string& client);
  void stop();
  /// How many wait.
  std::size_t waiting() const;

 private:
  void let_begin();
  void end(const std::string& id);

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  unsigned free_;
  BuildTurns waiting_;
  std::map<std::string, bool> places_;  ///< of those that wait or run, and whether they have begun
};

}  // namespace cordillera::server
