#include "server/http.h"

#include <httplib.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "server/connection_threads.h"
#include "server/json.h"
#include "server/log.h"

namespace cordillera::server {
namespace {

constexpr int kBacklog = 512;                                    // httplib's own 5 drops the connections of a map that zooms
constexpr std::uint64_t kMostDrained = std::uint64_t{64} << 20;  // of a refused body, so that the client reads the refusal
constexpr auto kLinger = std::chrono::seconds(3);                // after it, or a client that still sends is reset before it has read

std::string lower(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/// %41 and + to what they mean; what is no escape stays.
std::string decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
    const int low = high >= 0 ? hex_digit(text[i + 2]) : -1;
    if (low >= 0) {
      out += static_cast<char>(high * 16 + low);
      i += 2;
    } else {
      out += text[i] == '+' ? ' ' : text[i];
    }
  }
  return out;
}

/// httplib keeps parameters in a map of its own order; problems should name the first bad one as sent.
std::vector<std::pair<std::string, std::string>> query_of(const std::string& target) {
  std::vector<std::pair<std::string, std::string>> query;
  const auto mark = target.find('?');
  if (mark == std::string::npos) return query;
  std::string_view rest = std::string_view(target).substr(mark + 1);
  rest = rest.substr(0, rest.find('#'));
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    if (pair.empty()) continue;
    const auto equals = pair.find('=');
    query.emplace_back(decoded(pair.substr(0, equals)),
                       equals == std::string_view::npos ? "" : decoded(pair.substr(equals + 1)));
  }
  return query;
}

Request to_request(const httplib::Request& from) {
  Request request;
  request.method = from.method;
  request.path = from.path;
  request.query = query_of(from.target);
  for (const auto& [name, value] : from.headers) request.headers.emplace(lower(name), value);
  return request;
}

/// Sends the body and then says that writing failed: the one way to make httplib close a connection whose request was not
/// wholly read.
void send_and_close(httplib::Response& to, const std::string& body, const std::string& type, std::chrono::seconds linger) {
  to.set_header("Connection", "close");
  to.set_content_provider(body.size(), type, [body, linger](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
    sink.write(body.data() + offset, length);
    std::this_thread::sleep_for(linger);
    return false;
  });
}

enum class Connection { keep, close, linger };

void fill(httplib::Response& to, Response from, Connection connection) {
  to.status = from.status;
  std::string type = "application/octet-stream";
  for (const auto& [name, value] : from.headers) {
    if (name == "Content-Type") {
      type = value;
    } else {
      to.set_header(name, value);
    }
  }
  if (from.next_piece) {
    to.set_chunked_content_provider(type, [next = std::move(from.next_piece)](std::size_t, httplib::DataSink& sink) {
      const auto piece = next();
      if (!piece) {
        sink.done();
        return true;
      }
      return sink.write(piece->data(), piece->size());
    });
  } else if (connection != Connection::keep && !from.body.empty()) {
    send_and_close(to, from.body, type, connection == Connection::linger ? kLinger : std::chrono::seconds(0));
  } else if (!from.body.empty()) {
    to.set_content(from.body, type);
  }
}

/// httplib serves a connection a task.
class Connections : public httplib::TaskQueue {
 public:
  void enqueue(std::function<void()> connection) override { threads_.run(std::move(connection)); }
  void shutdown() override { threads_.stop(); }

 private:
  ConnectionThreads threads_{kMostConnections};
};

class HttplibServer : public HttpServer, private httplib::Server {
 public:
  explicit HttplibServer(Api& api) : api_(api) { set_up(); }

  bool bind_to(const std::string& host, int port) {
    port_ = port == 0 ? bind_to_any_port(host) : (bind_to_port(host, port) ? port : -1);
    if (port_ <= 0) return false;
    ::listen(svr_sock_, kBacklog);
    return true;
  }
  int port() const override { return port_; }
  void run() override {
    listen_after_bind();
    ended_ = true;
  }
  void stop() override {
    // httplib forgets a stop that comes before it listens, and would then serve for ever.
    while (!is_running() && !ended_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    httplib::Server::stop();
  }

 private:
  void set_up() {
    new_task_queue = [] { return new Connections; };
    // httplib's own options include SO_REUSEPORT: two servers would share a port, and each would get some of the requests.
    set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    set_tcp_nodelay(true);
    set_keep_alive_max_count(1000);
    set_keep_alive_timeout(5);
    set_read_timeout(60);
    set_write_timeout(60);
    set_payload_max_length(
        std::numeric_limits<std::size_t>::max());  // the API has a limit of its own, which chunked bodies meet too
    // Without a word from us httplib would promise ranges in every answer to a HEAD.
    set_default_headers({{"Server", "Cordillera"}, {"Accept-Ranges", "none"}});
    const auto plain = [this](const httplib::Request& from, httplib::Response& to) { answer(from, to); };
    const auto with_body = [this](const httplib::Request& from, httplib::Response& to, const httplib::ContentReader& reader) {
      answer_with_body(from, to, reader);
    };
    Get(".*", plain);
    Options(".*", plain);
    Post(".*", with_body);
    Put(".*", with_body);
    Patch(".*", with_body);
    Delete(".*", with_body);
    set_error_handler([](const httplib::Request&, httplib::Response& to) { explain(to); });
    set_exception_handler([](const httplib::Request&, httplib::Response& to, std::exception_ptr) { to.status = 500; });
    set_expect_100_continue_handler([this](const httplib::Request& from, httplib::Response& to) {
      auto refused = api_.refuse_early(to_request(from));
      if (!refused) return 100;
      fill(to, std::move(*refused), Connection::close);
      return to.status;
    });
    set_logger([](const httplib::Request& from, const httplib::Response& to) {
      log_debug(from.remote_addr + " " + from.method + " " + from.target.substr(0, 300) + " " + std::to_string(to.status));
    });
  }

  /// Errors that httplib finds itself come without a body.
  static void explain(httplib::Response& to) {
    if (!to.body.empty() || to.has_header("Content-Type") || to.content_provider_) return;
    to.set_header("Access-Control-Allow-Origin", "*");
    fill(to, problem_response(problem_of(to.status)), Connection::keep);
  }
  static proto::Problem problem_of(int httplibs_status) {
    if (httplibs_status == 414) return {"uri-too-long", "the address is too long", "an address of at most 8 KiB", ""};
    if (httplibs_status == 416) return {"range-invalid", "the Range header cannot be read", "no Range header: ranges are not served", "Range"};
    if (httplibs_status >= 500) return {"internal", "the service failed to answer this request", "", ""};
    return {"request-invalid", "the request is not valid HTTP/1.1", "a request line, headers and a body as RFC 9112 has them", ""};
  }

  void answer(const httplib::Request& from, httplib::Response& to) {
    // Ranges are answered with the whole, as any server may: tiles are small, and httplib would cut error documents and 304s as well.
    const_cast<httplib::Request&>(from).ranges.clear();
    fill(to, api_.handle(to_request(from)), Connection::keep);
  }

  void answer_with_body(const httplib::Request& from, httplib::Response& to, const httplib::ContentReader& reader) {
    const_cast<httplib::Request&>(from).ranges.clear();
    // Without a length there is no body; httplib would wait for one until the connection ends.
    const bool has_body = from.has_header("Content-Length") || from.has_header("Transfer-Encoding");
    bool touched = false, ended = false;
    Request request = to_request(from);
    request.read_body = [&](const Request::Sink& sink) {
      touched = true;
      ended = has_body && reader([&](const char* bytes, std::size_t count) { return sink({bytes, count}); });
      return ended || !has_body;
    };
    Response response = api_.handle(request);
    if (has_body && !touched && !from.is_multipart_form_data()) {
      std::uint64_t drained = 0;
      ended = reader([&](const char*, std::size_t count) { return (drained += count) <= kMostDrained; });
    }
    to.headers.erase("EXCEPTION_WHAT");
    fill(to, std::move(response), has_body && !ended ? Connection::linger : Connection::keep);
  }

  Api& api_;
  int port_ = -1;
  std::atomic<bool> ended_{false};
};

}  // namespace

proto::Result<std::unique_ptr<HttpServer>> HttpServer::bind(Api& api, const std::string& listen) {
  const auto colon = listen.rfind(':');
  std::string host = listen.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  auto server = std::make_unique<HttplibServer>(api);
  if (!server->bind_to(host, std::atoi(listen.substr(colon + 1).c_str()))) {
    const std::string why = errno == EADDRINUSE ? ": another program listens there" : "";
    return proto::Problem{"listen-failed", "cannot listen on " + listen + why, "an address of this machine and a port that is free",
                          "--listen"};
  }
  return std::unique_ptr<HttpServer>(std::move(server));
}

}  // namespace cordillera::server
