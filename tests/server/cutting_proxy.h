#pragma once
// A way to a server that breaks: it hands bytes on in both directions, until it has handed on as many of the client's as it was
// told to.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

namespace cordillera::server {

class CuttingProxy {
 public:
  enum class After { cut, hold };

  explicit CuttingProxy(int target) : target_(target), listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(listener_, 16), 0);
    getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    accepter_ = std::thread([this] { accept_all(); });
  }
  ~CuttingProxy() {
    stopping_ = true;
    accepter_.join();
    for (std::thread& thread : threads_) thread.join();
    close(listener_);
  }
  CuttingProxy(const CuttingProxy&) = delete;
  CuttingProxy& operator=(const CuttingProxy&) = delete;

  std::string base() const { return "http://127.0.0.1:" + std::to_string(port_); }
  /// Where connections go from now on: a server that was started again listens elsewhere.
  void lead_to(int port) { target_ = port; }
  /// When so many more bytes of clients have gone on, once: the connection is cut, or nothing goes on any more.
  void after(long bytes, After what) {
    what_ = what;
    allowed_ = handed_on_ + bytes;
  }
  void without_end() { allowed_ = kEndless; }
  /// Bytes of clients that have gone on.
  long handed_on() const { return handed_on_; }
  bool reached() const { return handed_on_ >= allowed_ || cuts_ > 0; }
  int cuts() const { return cuts_; }

 private:
  static constexpr long kEndless = 1L << 60;

  static sockaddr_in loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }

  void accept_all() {
    while (!stopping_) {
      pollfd wanted{listener_, POLLIN, 0};
      if (poll(&wanted, 1, 20) <= 0) continue;
      const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      if (client >= 0) threads_.emplace_back([this, client] { carry(client); });
    }
  }

  void carry(int client) {
    const int server = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_in address = loopback(target_);
    if (connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
      while (!stopping_ && carry_some(client, server)) {}
    }
    close(client);
    close(server);
  }

  bool carry_some(int client, int server) {
    const bool held = handed_on_ >= allowed_;
    pollfd wanted[2] = {{client, static_cast<short>(held ? 0 : POLLIN), 0}, {server, POLLIN, 0}};
    if (poll(wanted, 2, 20) <= 0) return true;
    if (wanted[1].revents != 0 && pass(server, client, 65536) == 0) return false;
    if (wanted[0].revents & POLLIN) {
      const long count = pass(client, server, std::min(65536L, allowed_ - handed_on_));
      if (count == 0) return false;
      handed_on_ += count;
      if (handed_on_ >= allowed_ && what_ == After::cut) {
        ++cuts_;
        allowed_ = kEndless;
        return false;
      }
    }
    return wanted[0].revents == 0 || (wanted[0].revents & POLLIN) != 0;
  }

  /// How many bytes went; 0: one of the two has ended.
  static long pass(int from, int to, long most) {
    char bytes[65536];
    const ssize_t count = recv(from, bytes, static_cast<std::size_t>(most), 0);
    for (ssize_t sent = 0; sent < count;) {
      const ssize_t now = send(to, bytes + sent, static_cast<std::size_t>(count - sent), MSG_NOSIGNAL);
      if (now <= 0) return 0;
      sent += now;
    }
    return std::max<long>(count, 0);
  }

  std::atomic<int> target_;
  int listener_, port_ = 0;
  std::atomic<bool> stopping_{false};
  std::atomic<long> handed_on_{0}, allowed_{kEndless};
  std::atomic<After> what_{After::cut};
  std::atomic<int> cuts_{0};
  std::thread accepter_;
  std::vector<std::thread> threads_;  ///< of the accepter
};

}  // namespace cordillera::server
