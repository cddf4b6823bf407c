#include "server/front/loop.h"

#include <boost/asio/post.hpp>
#include <utility>

#include "server/access/client_address.h"
#include "server/front/connection.h"
#include "server/front/message/answer_head.h"
#include "server/log/log.h"

namespace cordillera::server::front {
namespace {

constexpr auto kTick = std::chrono::milliseconds(250);
// A build that reports often is told of twenty times a second; one that does not, at once.
constexpr auto kNews = std::chrono::milliseconds(50);
constexpr std::size_t kScratch = std::size_t{256} << 10;

/// One more, until the pointer goes.
std::shared_ptr<void> counted(std::atomic<std::size_t>& sockets) {
  ++sockets;
  return {&sockets, [](void* count) { --*static_cast<std::atomic<std::size_t>*>(count); }};
}

}  // namespace

Loop::Loop(Shared& shared)
    : shared_(shared), work_(io_.get_executor()), ticks_(io_), news_(io_), scratch_(kScratch), date_(http_date()) {}

Loop::~Loop() = default;

void Loop::run() {
  while (true) {
    try {
      tick();
      io_.run();
      return;
    } catch (const std::exception& error) {
      // Want of memory, outside of any connection. All of them are as they were; the clock begins anew above.
      try {
        log_warning(std::string("a loop of connections: ") + error.what());
      } catch (const std::exception&) {
        // No memory for words either.
      }
    }
  }
}

void Loop::adopt(boost::asio::ip::tcp::socket socket) {
  // Here already: a loop that has much to do must not let them pile up uncounted.
  boost::asio::post(io_, [this, place = counted(shared_.sockets), socket = std::move(socket)]() mutable {
    boost::system::error_code error;
    const auto peer = socket.remote_endpoint(error);
    if (error || stopping_) return;
    const bool room = shared_.connections.all() < shared_.limits.connections || make_room() == Room::made;
    const std::string address = peer.address().to_string();
    // A proxy's are those of all its clients.
    const bool is_proxy = access::is_trusted(address, shared_.limits.trusted_proxies);
    const auto most = is_proxy ? shared_.limits.connections : shared_.limits.connections_per_client;
    auto share = room ? shared_.connections.take(is_proxy ? address : access::share_of(address), most) : nullptr;
    const bool welcome = share != nullptr;
    const auto connection = std::make_shared<Connection>(*this, std::move(socket), std::move(place), std::move(share));
    connections_.insert(connection);
    if (welcome) return connection->guarded([&] { connection->start(); });
    const auto why = room ? proto::Problem{"too-many-connections", "this address has too many connections open",
                                           "at most " + std::to_string(shared_.limits.connections_per_client) + " at a time", ""}
                          : proto::Problem{"service-busy", "too many clients are connected", "trying again later", ""};
    connection->guarded([&] { connection->refuse(why); });
  });
}

/// The connection whose last word was said first goes, or else that which has been idle for longest: its client only has to
/// connect again.
Loop::Room Loop::make_room() {
  std::shared_ptr<Connection> spare;
  const auto before = [](const Connection& a, const Connection& b) {
    return std::pair(!a.lingering(), a.since()) < std::pair(!b.lingering(), b.since());
  };
  for (const auto& connection : connections_) {
    const bool may_go = connection->idle() || connection->lingering();
    if (may_go && (!spare || before(*connection, *spare))) spare = connection;
  }
  if (spare) spare->close();
  return spare ? Room::made : Room::none;
}

void Loop::make_room(std::function<void(Room)> done) {
  boost::asio::post(io_, [this, done = std::move(done)] { done(stopping_ ? Room::none : make_room()); });
}

void Loop::forget(const std::shared_ptr<Connection>& connection) {
  connections_.erase(connection);
  if (stopping_ && connections_.empty()) {
    ticks_.cancel();
    work_.reset();
  }
}

void Loop::tick() {
  date_ = http_date();
  const auto now = Clock::now();
  const std::vector<std::shared_ptr<Connection>> all(connections_.begin(), connections_.end());  // ticks may close them
  for (const auto& connection : all) {
    connection->guarded([&] { connection->tick(now); });
    if (stopping_ && now >= stop_at_) connection->close();
  }
  if (stopping_ && connections_.empty()) return work_.reset();
  ticks_.expires_after(kTick);
  ticks_.async_wait([this](const boost::system::error_code& error) {
    if (!error) tick();
  });
}

void Loop::changed() {
  if (changed_.exchange(true)) return;
  boost::asio::post(io_, [this] {
    news_.expires_at(told_at_ + kNews);
    news_.async_wait([this](const boost::system::error_code&) { tell_changed(); });
  });
}

void Loop::tell_changed() {
  changed_ = false;
  told_at_ = Clock::now();
  const std::vector<std::shared_ptr<Connection>> all(connections_.begin(), connections_.end());
  for (const auto& connection : all) connection->guarded([&] { connection->changed(); });
}

void Loop::stop() {
  boost::asio::post(io_, [this] {
    stopping_ = true;
    stop_at_ = Clock::now() + shared_.limits.drain;
    const std::vector<std::shared_ptr<Connection>> all(connections_.begin(), connections_.end());
    for (const auto& connection : all) connection->guarded([&] { connection->finish(); });
    if (connections_.empty()) {
      ticks_.cancel();
      work_.reset();
    }
  });
}

}  // namespace cordillera::server::front
