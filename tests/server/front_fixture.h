#pragma once
// A service behind its socket, with limits that a test can reach.
#include <memory>
#include <thread>

#include "fixture.h"
#include "raw_client.h"
#include "server/front/http_server.h"
#include "server/limits/descriptors.h"

namespace cordillera::server {

class Front {
 public:
  explicit Front(const front::HttpLimits& given = {}, front::OnServed on_served = {}, const Settings& settings = {})
      : test_(settings) {
    limits::raise_descriptor_limit();  // both ends of every connection are this process's
    auto bound = front::HttpServer::bind(test_.api(), "127.0.0.1:0", given, std::move(on_served));
    if (!bound) throw std::runtime_error(bound.problem().line());
    http_ = std::move(bound.value());
    thread_ = std::thread([this] { http_->run(); });
  }
  ~Front() { stop(); }
  Front(const Front&) = delete;
  Front& operator=(const Front&) = delete;

  void stop() {
    if (!thread_.joinable()) return;
    test_.service().stop();
    http_->stop();
    thread_.join();
  }
  RawClient client(int window = 0) const { return RawClient(http_->port(), window); }
  /// What comes to these bytes until the server closes.
  std::string answer(const std::string& bytes) const {
    RawClient client = this->client();
    client.say(bytes);
    return client.rest();
  }
  TestService& test() { return test_; }

 private:
  TestService test_;
  std::unique_ptr<front::HttpServer> http_;
  std::thread thread_;
};

inline std::string get(const std::string& path, const std::string& headers = "") {
  return "GET " + path + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n";
}

/// Threads of this process.
inline std::size_t threads() {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) count += entry.is_directory() ? 1 : 0;
  return count;
}

}  // namespace cordillera::server
