#include "server/fetch/http_get.h"

#include <algorithm>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <chrono>
#include <limits>
#include <memory>

#include "server/fetch/addresses.h"
#include "server/fetch/apart.h"

namespace cordillera::server::updates {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using asio::ip::tcp;
using Error = beast::error_code;
using Places = tcp::resolver::results_type;

constexpr std::uint32_t kMostHead = 64u << 10;  // a Location may hold a long signature
constexpr std::size_t kPiece = std::size_t{64} << 10;
constexpr int kMostInterim = 8;  // answers 1xx before the one that counts

struct Origin {
  bool secure;
  std::string authority;  ///< "host:8080"
  std::string host, port;
};

/// host: with its scheme, as host_and_target gives it.
Origin origin_of(const std::string& host) {
  Origin origin;
  origin.secure = host.starts_with("https://");
  origin.authority = host.substr(host.find("://") + 3);
  const std::size_t name_end = origin.authority.starts_with('[') ? origin.authority.find(']') : 0;  // [::1]:8080
  const std::size_t colon = origin.authority.find(':', std::min(name_end, origin.authority.size()));
  origin.host = origin.authority.substr(0, colon);
  if (origin.host.starts_with('[') && origin.host.ends_with(']')) origin.host = origin.host.substr(1, origin.host.size() - 2);
  origin.port = colon == std::string::npos ? (origin.secure ? "443" : "80") : origin.authority.substr(colon + 1);
  return origin;
}

Got failed(const std::string& what, const Error& error) {
  Got got;
  got.trouble = what + ": " + (error == beast::error::timeout ? "nothing came for too long" : error.message());
  return got;
}

constexpr auto kBetweenLooks = std::chrono::milliseconds(50);  // at whether it is to stop

bool is_late(const Terms& terms) { return terms.until && std::chrono::steady_clock::now() >= *terms.until; }

struct LookedUp {
  Places places;
  Error error;
};

/// The system's look-up takes as long as its servers do, up to minutes.
LookedUp look_up(const Origin& origin, const Terms& terms) {
  const auto find = [origin] {
    asio::io_context context;
    LookedUp found;
    found.places = tcp::resolver(context).resolve(origin.host, origin.port, tcp::resolver::numeric_service, found.error);
    return found;
  };
  Error is_a_name;
  asio::ip::make_address(origin.host, is_a_name);
  if (!is_a_name) return find();
  const auto end = std::chrono::steady_clock::now() + terms.patience;
  auto found = apart<LookedUp>(
      find, [&] { return (terms.stopped && terms.stopped()) || is_late(terms) || std::chrono::steady_clock::now() >= end; });
  return found ? std::move(*found) : LookedUp{{}, beast::error::timeout};
}

}  // namespace

enum class Keep { connection, nothing };

/// A connection.
class HttpWire {
 public:
  virtual ~HttpWire() = default;
  /// Nothing: there is one.
  virtual std::optional<Got> connect(const Origin& origin, const Terms& terms) = 0;
  virtual Got get(const Origin& origin, const std::string& target, const Take& take, const Terms& terms, Keep keep) = 0;
  /// Whether another request may follow the last one.
  bool can_go_on() const { return can_go_on_; }

 protected:
  asio::io_context context_{1};
  bool can_go_on_ = false;
};

namespace {

template <typename Stream>
class Exchange : public HttpWire {
 public:
  Got get(const Origin& origin, const std::string& target, const Take& take, const Terms& terms, Keep keep) override {
    can_go_on_ = false;
    http::request<http::empty_body> request(http::verb::get, target, 11);
    request.set(http::field::host, origin.authority);
    request.set(http::field::accept_encoding, "identity");
    request.set(http::field::user_agent, std::string("cordillera/") + CORDILLERA_VERSION);
    if (keep == Keep::nothing) request.set(http::field::connection, "close");
    for (const auto& [field, text] : {std::pair{http::field::if_none_match, &terms.etag},
                                      {http::field::range, &terms.range},
                                      {http::field::if_range, &terms.if_range}}) {
      if (!text->empty()) request.set(field, *text);
    }
    if (const Error error = step(terms, [&](auto done) { http::async_write(stream(), request, done); }))
      return failed("it takes no request", error);
    for (int interim = 0; interim <= kMostInterim; ++interim) {
      http::response_parser<http::buffer_body> parser;
      parser.header_limit(kMostHead);
      parser.body_limit(std::numeric_limits<std::uint64_t>::max());  // take knows it; in Boost 1.74 none is less than any length
      if (const Error error = step(terms, [&](auto done) { http::async_read_header(stream(), buffer_, parser, done); }))
        return failed("it sends no answer that can be read", error);
      const auto& head = parser.get();
      if (head.result_int() / 100 == 1) continue;
      Got got;
      got.status = static_cast<int>(head.result_int());
      const auto text = [&](http::field name) { return std::string(head[name].data(), head[name].size()); };
      got.location = text(http::field::location);
      got.etag = text(http::field::etag);
      got.modified = text(http::field::last_modified);
      got.range = text(http::field::content_range);
      got.length = parser.content_length().value_or(0);
      const bool wanted = terms.wanted ? terms.wanted(got) : got.status == 200;
      if (wanted) got.trouble = take_body(terms, parser, take);
      can_go_on_ = keep == Keep::connection && wanted && got.trouble.empty() && parser.is_done() && parser.keep_alive() &&
                   buffer_.size() == 0;
      return got;
    }
    Got got;
    got.trouble = "it begins to answer again and again";
    return got;
  }

 protected:
  virtual Stream& stream() = 0;

  /// Begins a step and waits for its end: only asynchronous ones have a limit of time.
  template <typename Begin>
  Error step(const Terms& terms, const Begin& begin) {
    using Clock = std::chrono::steady_clock;
    if (is_late(terms)) return beast::error::timeout;  // however often a byte comes
    Error error;
    Clock::duration patience = terms.patience;
    if (terms.until) patience = std::clamp<Clock::duration>(*terms.until - Clock::now(), std::chrono::milliseconds(1), patience);
    auto& socket = beast::get_lowest_layer(stream());
    socket.expires_after(patience);
    begin([&error](const Error& happened, const auto&...) { error = happened; });
    context_.restart();
    while (terms.stopped && !context_.stopped() && !terms.stopped()) context_.run_for(kBetweenLooks);
    if (terms.stopped && !context_.stopped()) socket.close();
    context_.run();
    return error;
  }

  std::optional<Got> join(const Origin& origin, const Terms& terms) {
    const auto [found, unknown] = look_up(origin, terms);
    if (unknown) return failed("its host is not known", unknown);
    const auto& places = found;  // no lambda of clang 14 takes a structured binding
    if (const Error error = step(terms, [&](auto done) { beast::get_lowest_layer(stream()).async_connect(places, done); }))
      return failed("no connection could be made", error);
    return std::nullopt;
  }

 private:
  /// Why it is not whole.
  std::string take_body(const Terms& terms, http::response_parser<http::buffer_body>& parser, const Take& take) {
    const auto piece = std::make_unique<char[]>(kPiece);
    while (!parser.is_done()) {
      auto& body = parser.get().body();
      body.data = piece.get();
      body.size = kPiece;
      const Error error = step(terms, [&](auto done) { http::async_read_some(stream(), buffer_, parser, done); });
      const std::size_t count = kPiece - body.size;
      if (count > 0 && !take({piece.get(), count})) return "it was broken off here";
      if (error && error != http::error::need_buffer) return failed("it broke off", error).trouble;
    }
    return {};
  }

  beast::flat_buffer buffer_;  ///< what came behind what was read
};

class PlainWire final : public Exchange<beast::tcp_stream> {
 public:
  std::optional<Got> connect(const Origin& origin, const Terms& terms) override { return join(origin, terms); }

 private:
  beast::tcp_stream& stream() override { return stream_; }
  beast::tcp_stream stream_{context_};
};

asio::ssl::context system_trust() {
  asio::ssl::context trust(asio::ssl::context::tls_client);
  trust.set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 | asio::ssl::context::no_tlsv1_1);
  trust.set_default_verify_paths();
  trust.set_verify_mode(asio::ssl::verify_peer);
  return trust;
}

class TlsWire final : public Exchange<beast::ssl_stream<beast::tcp_stream>> {
 public:
  std::optional<Got> connect(const Origin& origin, const Terms& terms) override {
    stream_.set_verify_callback(asio::ssl::host_name_verification(origin.host));
    Error no_number;
    asio::ip::make_address(origin.host, no_number);
    if (no_number && SSL_set_tlsext_host_name(stream_.native_handle(), origin.host.c_str()) != 1)
      return failed("its name cannot be asked for", no_number);
    if (auto cannot = join(origin, terms)) return cannot;
    if (const Error error = step(terms, [&](auto done) { stream_.async_handshake(asio::ssl::stream_base::client, done); }))
      return failed("no TLS could be agreed on with it", error);
    return std::nullopt;
  }

 private:
  beast::ssl_stream<beast::tcp_stream>& stream() override { return stream_; }
  asio::ssl::context trust_ = system_trust();
  beast::ssl_stream<beast::tcp_stream> stream_{context_, trust_};
};

/// wire: becomes the connection.
Got get_anew(std::unique_ptr<HttpWire>& wire, const Origin& origin, const std::string& target, const Take& take,
             const Terms& terms, Keep keep) {
  if (origin.secure)
    wire = std::make_unique<TlsWire>();
  else
    wire = std::make_unique<PlainWire>();
  if (auto cannot = wire->connect(origin, terms)) return *cannot;
  return wire->get(origin, target, take, terms, keep);
}

}  // namespace

Got http_get(const std::string& address, const Take& take, const Terms& terms) {
  const auto [host, target] = host_and_target(address);
  std::unique_ptr<HttpWire> wire;
  return get_anew(wire, origin_of(host), target, take, terms, Keep::nothing);
}

HttpTalk::HttpTalk() = default;
HttpTalk::~HttpTalk() = default;

Got HttpTalk::get(const std::string& address, const Take& take, const Terms& terms) {
  const auto [host, target] = host_and_target(address);
  const Origin origin = origin_of(host);
  if (wire_ && wire_->can_go_on() && host == host_) {
    Got got = wire_->get(origin, target, take, terms, Keep::connection);
    if (got.status != 0) return got;  // else the host has closed it meanwhile
  }
  host_ = host;
  return get_anew(wire_, origin, target, take, terms, Keep::connection);
}

}  // namespace cordillera::server::updates
