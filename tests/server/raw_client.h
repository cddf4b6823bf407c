#pragma once
// A client that says to a server on this machine exactly what it is told, however wrong.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <utility>

namespace cordillera::server {

class RawClient {
 public:
  /// window: of what the system receives for us, bytes; 0: the usual.
  explicit RawClient(int port, int window = 0) : descriptor_(socket(AF_INET, SOCK_STREAM, 0)) {
    if (window > 0) setsockopt(descriptor_, SOL_SOCKET, SO_RCVBUF, &window, sizeof window);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  RawClient(RawClient&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)), seen_(std::move(other.seen_)) {}
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;
  ~RawClient() { close(); }

  void close() {
    if (descriptor_ >= 0) ::close(descriptor_);
    descriptor_ = -1;
  }
  /// False if the other side is gone.
  bool say(const std::string& bytes) {
    std::size_t sent = 0;
    while (sent < bytes.size()) {
      const ssize_t count = send(descriptor_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return false;
      sent += static_cast<std::size_t>(count);
    }
    return true;
  }
  /// Nothing more will be said; it still listens.
  void half_close() { shutdown(descriptor_, SHUT_WR); }

  /// Reads until the other side closes, or nothing comes for the time.
  std::string rest(std::chrono::milliseconds patience = std::chrono::minutes(2)) {
    while (more(patience)) {}
    return seen_;
  }
  /// Reads until what was read holds the words; false: it ended before.
  bool until(const std::string& words) {
    while (seen_.find(words) == std::string::npos) {
      if (!more(std::chrono::minutes(2))) return false;
    }
    return true;
  }
  const std::string& seen() const { return seen_; }
  bool ended() const { return ended_; }  ///< the other side has closed

 private:
  bool more(std::chrono::milliseconds patience) {
    pollfd wanted{descriptor_, POLLIN, 0};
    if (poll(&wanted, 1, static_cast<int>(patience.count())) <= 0) return false;
    char bytes[16384];
    const ssize_t count = recv(descriptor_, bytes, sizeof bytes, 0);
    ended_ = count <= 0;
    if (count > 0) seen_.append(bytes, static_cast<std::size_t>(count));
    return count > 0;
  }

  int descriptor_;
  std::string seen_;
  bool ended_ = false;
};

inline std::size_t count_of(const std::string& text, const std::string& words) {
  std::size_t count = 0;
  for (auto at = text.find(words); at != std::string::npos; at = text.find(words, at + words.size())) ++count;
  return count;
}

}  // namespace cordillera::server
