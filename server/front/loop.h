#pragma once
// A thread and the connections that live on it.
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "server/front/shared.h"

namespace cordillera::server::front {

class Connection;

class Loop {
 public:
  explicit Loop(Shared& shared);
  ~Loop();

  Shared& shared() { return shared_; }
  boost::asio::io_context& io() { return io_; }

  /// Returns when stop() was called and the answers under way have gone out, or HttpLimits::drain is over.
  void run();

  // From any thread.
  /// The socket must be of io(). It counts among Shared::sockets from here on.
  void adopt(boost::asio::ip::tcp::socket socket);
  void changed();
  void stop();
  /// Closes the connection that can be spared best, if there is one, and says so, on the loop's thread.
  enum class Room : std::uint8_t { none, made };
  void make_room(std::function<void(Room)> done);

  // From the loop's own thread.
  void forget(const std::shared_ptr<Connection>& connection);
  std::vector<char>& scratch() { return scratch_; }
  const std::string& date() const { return date_; }

 private:
  void tick();
  void tell_changed();
  Room make_room();

  Shared& shared_;
  boost::asio::io_context io_{1};
  std::optional<boost::asio::executor_work_guard<boost::asio::io_context::executor_type>> work_;
  boost::asio::steady_timer ticks_, news_;
  std::atomic<bool> changed_{false};
  std::chrono::steady_clock::time_point told_at_;  ///< connections, of news
  bool stopping_ = false;
  std::chrono::steady_clock::time_point stop_at_;
  std::unordered_set<std::shared_ptr<Connection>> connections_;
  std::vector<char> scratch_;
  std::string date_;
};

}  // namespace cordillera::server::front
