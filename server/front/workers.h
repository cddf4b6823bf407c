#pragma once
// Threads for requests that take a while, shared fairly between clients.
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace cordillera::server::front {

/// Clients take turns: one that asks for a thousand things delays another's by one of them. Threads start as they are needed; the
/// first one at once, so that a server that has begun never lacks it: where none can be had, the constructor throws.
class Workers {
 public:
  /// most_per_client: works of one client at a time, waiting ones included.
  Workers(std::size_t threads, std::size_t most, std::size_t most_per_client);
  ~Workers() { stop(); }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  enum class Taken { yes, full, client_has_many };
  Taken run(const std::string& client, std::function<void()> work);
  /// What was given is done first; nothing may be given afterwards.
  void stop();

 private:
  struct Client {
    std::deque<std::function<void()>> waiting;
    std::size_t works = 0;  ///< waiting and running
  };
  using Clients = std::map<std::string, Client>;
  void serve();
  std::function<void()> next(Clients::iterator its);

  std::mutex mutex_;
  std::condition_variable work_or_stop_;
  Clients clients_;
  std::list<Clients::iterator> turns_;  ///< clients that have something waiting, each once
  std::vector<std::thread> threads_;
  std::size_t threads_most_, most_, most_per_client_, works_ = 0, idle_ = 0, waiting_ = 0;
  bool stopping_ = false;
};

}  // namespace cordillera::server::front
