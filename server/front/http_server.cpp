#include "server/front/http_server.h"

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <thread>
#include <vector>

#include "server/front/loop.h"
#include "server/limits/descriptors.h"
#include "server/log/log.h"
#include "server/memory/heap.h"

namespace cordillera::server::front {
namespace {

using boost::asio::ip::tcp;
using Error = boost::system::error_code;

constexpr int kBacklog = 1024;  // a map that zooms opens many connections at once
constexpr auto kNoDescriptors = std::chrono::milliseconds(100);

class AsioServer final : public HttpServer {
 public:
  AsioServer(Api& api, const HttpLimits& limits, OnServed on_served)
      : shared_(api, limits, std::move(on_served)),
        most_sockets_(limits.connections + limits::refused_sockets(limits.connections)) {
    for (std::size_t k = 0; k < limits.loops; ++k) loops_.push_back(std::make_unique<Loop>(shared_));
    acceptor_ = std::make_unique<tcp::acceptor>(loops_[0]->io());
    retry_ = std::make_unique<boost::asio::steady_timer>(loops_[0]->io());
    api.on_change([this] {
      for (const auto& loop : loops_) loop->changed();
    });
  }
  ~AsioServer() override { shared_.api.on_change(nullptr); }

  Error bind_to(const std::string& host, const std::string& port) {
    Error error;
    tcp::resolver resolver(loops_[0]->io());
    const auto found = resolver.resolve(host, port, tcp::resolver::passive, error);
    for (const auto& entry : found) {
      acceptor_->close(error);
      acceptor_->open(entry.endpoint().protocol(), error);
      // Not SO_REUSEPORT: two servers would share a port, and each would get some of the requests.
      if (!error) acceptor_->set_option(tcp::acceptor::reuse_address(true), error);
      if (!error) acceptor_->bind(entry.endpoint(), error);
      if (!error) acceptor_->listen(kBacklog, error);
      if (!error) return error;
    }
    return error;
  }

  int port() const override { return acceptor_->local_endpoint().port(); }
  std::size_t connections() const override { return shared_.connections.all(); }

  std::size_t unsent_bytes() const override { return shared_.unsent.all(); }

  void run() override {
    accept();
    std::vector<std::thread> threads;
    try {
      for (std::size_t k = 1; k < loops_.size(); ++k) {
        if (!has_memory_for_a_thread()) throw std::bad_alloc();
        threads.emplace_back([this, k] { loops_[k]->run(); });
        running_ = k + 1;
      }
    } catch (const std::exception& error) {
      log_warning(std::string("cannot start as many threads as there are cores: ") + error.what());
    }
    loops_[0]->run();
    for (std::thread& thread : threads) thread.join();
    // Handlers that still run read from connections that are closed by now.
    shared_.makers.stop();
    shared_.takers.stop();
  }

  void stop() override {
    shared_.stopping = true;
    boost::asio::post(loops_[0]->io(), [this] {
      Error ignored;
      acceptor_->close(ignored);
      retry_->cancel();
    });
    for (const auto& loop : loops_) loop->stop();
  }

 private:
  void accept() {
    if (!acceptor_->is_open()) return;
    // Who comes now waits in the system's queue, where it takes none of the descriptors that jobs and stores need.
    if (shared_.sockets >= most_sockets_) return make_room(0);
    Loop& loop = *loops_[next_++ % running_];
    acceptor_->async_accept(loop.io(), [this, &loop](const Error& error, tcp::socket socket) {
      if (!acceptor_->is_open()) return;
      if (!error) {
        try {
          loop.adopt(std::move(socket));
        } catch (const std::exception&) {
          // Want of memory: this one goes, the next may find some.
        }
        return accept();
      }
      const bool scarce =
          error == boost::asio::error::no_descriptors || error.value() == ENFILE || error == boost::asio::error::no_buffer_space;
      scarce ? make_room(0) : accept_later();
    });
  }

  /// Without a descriptor or a place left nobody comes in any more. The loops are asked in turn to close the connection that can
  /// be spared best.
  void make_room(std::size_t asked) {
    if (asked == running_) return accept_later();
    loops_[(next_ + asked) % running_]->make_room([this, asked](Loop::Room room) {
      boost::asio::post(loops_[0]->io(), [this, asked, room] { room == Loop::Room::made ? accept() : make_room(asked + 1); });
    });
  }

  void accept_later() {
    retry_->expires_after(kNoDescriptors);
    retry_->async_wait([this](const Error& cancelled) {
      if (!cancelled) accept();
    });
  }

  Shared shared_;
  const std::size_t most_sockets_;
  std::vector<std::unique_ptr<Loop>> loops_;
  std::unique_ptr<tcp::acceptor> acceptor_;
  std::unique_ptr<boost::asio::steady_timer> retry_;
  std::size_t next_ = 0;
  std::atomic<std::size_t> running_{1};  ///< loops that have a thread
};

}  // namespace

proto::Result<std::unique_ptr<HttpServer>> HttpServer::bind(Api& api, const std::string& listen, const HttpLimits& limits,
                                                            OnServed on_served) {
  const auto colon = listen.rfind(':');
  std::string host = listen.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  auto server = std::make_unique<AsioServer>(api, limits, std::move(on_served));
  if (const Error error = server->bind_to(host, listen.substr(colon + 1))) {
    const std::string why = error == boost::asio::error::address_in_use ? "another program listens there" : error.message();
    return proto::Problem{"listen-failed", "cannot listen on " + listen + ": " + why,
                          "an address of this machine and a port that is free", "--listen"};
  }
  return std::unique_ptr<HttpServer>(std::move(server));
}

}  // namespace cordillera::server::front
