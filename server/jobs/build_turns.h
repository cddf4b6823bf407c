#pragma once
// Whose build is next: clients take turns, so that one who posts a hundred rasters, or changes one a hundred times, delays another's by one.
#include <deque>
#include <list>
#include <map>
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

}  // namespace cordillera::server
