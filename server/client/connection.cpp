#include "server/client/connection.h"

#include <httplib.h>
#include <signal.h>

#include <algorithm>

#include "proto/letters.h"

namespace cordillera::server::client {
namespace {

constexpr std::size_t kPiece = std::size_t{256} << 10;  // of a body, between two looks at the connection

void take_head(const httplib::Response& response, Answer& answer) {
  answer.status = response.status;
  for (const auto& [name, value] : response.headers) answer.headers.emplace(proto::lower(name), value);
}

}  // namespace

struct Connection::State {
  explicit State(const ServiceAddress& to) : place(to), http(to.host) {
    // The library writes without MSG_NOSIGNAL; a service that closes must not end the program.
    signal(SIGPIPE, SIG_IGN);
    http.set_url_encode(false);
    http.set_follow_location(false);
    http.set_keep_alive(true);
    http.set_tcp_nodelay(true);
    http.set_connection_timeout(std::chrono::seconds(30));
    http.set_write_timeout(std::chrono::seconds(60));
  }

  httplib::Result get(const Call& call, const httplib::Headers& headers, Answer& answer) {
    const auto head = [&answer](const httplib::Response& response) {
      take_head(response, answer);
      return true;
    };
    return http.Get(place.prefix + call.path, headers, head, [&](const char* bytes, std::size_t count) {
      if (answer.status == 200 && call.take) return call.take({bytes, count});
      answer.body.append(bytes, count);
      return true;
    });
  }

  httplib::Result with_body(const Call& call, const httplib::Headers& headers) {
    const std::string path = place.prefix + call.path;
    const auto provide = [&call](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
      const auto piece = call.body(offset, std::min(length, kPiece));
      return piece && sink.write(piece->data(), piece->size());
    };
    if (call.method == "PATCH") return http.Patch(path, headers, call.length, provide, call.type);
    return http.Post(path, headers, call.length, provide, call.type);
  }

  httplib::Result send(const Call& call, const httplib::Headers& headers, Answer& answer) {
    const std::string path = place.prefix + call.path;
    if (call.method == "GET") return get(call, headers, answer);
    if (call.method == "HEAD") return http.Head(path, headers);
    if (call.method == "DELETE") return http.Delete(path, headers);
    return call.length > 0 ? with_body(call, headers) : http.Post(path, headers);
  }

  const ServiceAddress place;
  httplib::Client http;
};

Connection::Connection(const ServiceAddress& place) : state_(std::make_unique<State>(place)) {}
Connection::~Connection() = default;

Answer Connection::send(const Call& call) {
  httplib::Headers headers = {{"Accept-Encoding", "identity"}, {"User-Agent", std::string("cordillera/") + CORDILLERA_VERSION}};
  if (!state_->place.token.empty()) headers.emplace("Authorization", "Bearer " + state_->place.token);
  for (const auto& [name, value] : call.headers) headers.emplace(name, value);
  state_->http.set_read_timeout(call.patience);
  Answer answer;
  const httplib::Result result = state_->send(call, headers, answer);
  if (result) {
    if (answer.status == 0) take_head(*result, answer);
    if (answer.body.empty()) answer.body = result->body;
    return answer;
  }
  const httplib::Error error = result.error();
  answer.reached = error != httplib::Error::Connection && error != httplib::Error::ConnectionTimeout &&
                   error != httplib::Error::SSLConnection && error != httplib::Error::SSLServerVerification &&
                   error != httplib::Error::SSLLoadingCerts;
  switch (error) {
    case httplib::Error::Connection: answer.trouble = "no connection could be made"; break;
    case httplib::Error::ConnectionTimeout: answer.trouble = "it does not take the connection"; break;
    case httplib::Error::SSLServerVerification: answer.trouble = "its certificate is not to be trusted"; break;
    case httplib::Error::SSLConnection: answer.trouble = "it speaks no TLS that can be agreed on"; break;
    case httplib::Error::Canceled: answer.trouble = "it was broken off here"; break;
    default: answer.trouble = "the connection broke"; break;
  }
  return answer;
}

}  // namespace cordillera::server::client
