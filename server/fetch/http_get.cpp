#include "server/fetch/http_get.h"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <limits>
#include <memory>
#include <sstream>

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

namespace {

/// What a step gives when it is done. One type for all steps and streams: Beast and Asio are compiled once for it, and not again
/// for each.
using Done = std::function<void(const Error&, std::size_t)>;

/// The bytes of a connection, plain or in TLS: a stream as Asio means it, of one buffer at a time.
class Bytes {
 public:
  using executor_type = beast::tcp_stream::executor_type;
  virtual ~Bytes() = default;
  virtual beast::tcp_stream& socket() = 0;
  /// What has to be done before a connection is made; empty: it is done.
  virtual std::string prepare(const Origin&) { return {}; }
  /// What follows a connection before the first byte of a request.
  virtual void agree(Done done) = 0;
  virtual void read(asio::mutable_buffer into, Done done) = 0;
  virtual void write(asio::const_buffer from, Done done) = 0;

  executor_type get_executor() { return socket().get_executor(); }
  template <typename Buffers, typename Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    read(beast::buffers_front(buffers), shared(std::forward<Handler>(handler)));
  }
  template <typename Buffers, typename Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    write(beast::buffers_front(buffers), shared(std::forward<Handler>(handler)));
  }

 private:
  /// Handlers of composed steps can be moved alone, and a function is copied.
  template <typename Handler>
  static Done shared(Handler&& handler) {
    auto kept = std::make_shared<std::decay_t<Handler>>(std::forward<Handler>(handler));
    return [kept](const Error& error, std::size_t count) { (*kept)(error, count); };
  }
};

class PlainBytes final : public Bytes {
 public:
  explicit PlainBytes(asio::io_context& context) : stream_(context) {}
  beast::tcp_stream& socket() override { return stream_; }
  void agree(Done done) override {
    asio::post(get_executor(), [done] { done({}, 0); });
  }
  void read(asio::mutable_buffer into, Done done) override { stream_.async_read_some(into, std::move(done)); }
  void write(asio::const_buffer from, Done done) override { stream_.async_write_some(from, std::move(done)); }

 private:
  beast::tcp_stream stream_;
};

asio::ssl::context system_trust() {
  asio::ssl::context trust(asio::ssl::context::tls_client);
  trust.set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 | asio::ssl::context::no_tlsv1_1);
  trust.set_default_verify_paths();
  trust.set_verify_mode(asio::ssl::verify_peer);
  return trust;
}

class TlsBytes final : public Bytes {
 public:
  explicit TlsBytes(asio::io_context& context) : stream_(context, trust_) {}
  beast::tcp_stream& socket() override { return stream_.next_layer(); }
  std::string prepare(const Origin& origin) override {
    stream_.set_verify_callback(asio::ssl::host_name_verification(origin.host));
    Error no_number;
    asio::ip::make_address(origin.host, no_number);
    const bool may_be_asked_for = !no_number || SSL_set_tlsext_host_name(stream_.native_handle(), origin.host.c_str()) == 1;
    return may_be_asked_for ? "" : "its name cannot be asked for";
  }
  void agree(Done done) override {
    stream_.async_handshake(asio::ssl::stream_base::client, [done](const Error& error) { done(error, 0); });
  }
  void read(asio::mutable_buffer into, Done done) override { stream_.async_read_some(into, std::move(done)); }
  void write(asio::const_buffer from, Done done) override { stream_.async_write_some(from, std::move(done)); }

 private:
  asio::ssl::context trust_ = system_trust();
  asio::ssl::stream<beast::tcp_stream> stream_;
};

}  // namespace

/// A connection.
class HttpWire {
 public:
  explicit HttpWire(bool secure) {
    if (secure)
      bytes_ = std::make_unique<TlsBytes>(context_);
    else
      bytes_ = std::make_unique<PlainBytes>(context_);
  }
  /// Nothing: there is one.
  std::optional<Got> connect(const Origin& origin, const Terms& terms) {
    if (const std::string cannot = bytes_->prepare(origin); !cannot.empty()) return failed(cannot, Error());
    const LookedUp found = look_up(origin, terms);
    if (found.error) return failed("its host is not known", found.error);
    if (const Error error = step(terms, [&](const Done& done) {
          bytes_->socket().async_connect(found.places, [done](const Error& happened, const auto&) { done(happened, 0); });
        }))
      return failed("no connection could be made", error);
    if (const Error error = step(terms, [&](const Done& done) { bytes_->agree(done); }))
      return failed("no TLS could be agreed on with it", error);
    return std::nullopt;
  }
  Got get(const Origin& origin, const std::string& target, const Take& take, const Terms& terms, Keep keep) {
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
    std::ostringstream head_of_request;
    head_of_request << request.base();
    const std::string sent = head_of_request.str();
    if (const Error error = step(terms, [&](const Done& done) { asio::async_write(*bytes_, asio::buffer(sent), done); }))
      return failed("it takes no request", error);
    for (int interim = 0; interim <= kMostInterim; ++interim) {
      Parser parser;
      parser.header_limit(kMostHead);
      parser.body_limit(std::numeric_limits<std::uint64_t>::max());  // take knows it; in Boost 1.74 none is less than any length
      if (const Error error = step(terms, [&](const Done& done) { http::async_read_header(*bytes_, buffer_, parser, done); }))
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
  /// Whether another request may follow the last one.
  bool can_go_on() const { return can_go_on_; }

 private:
  using Parser = http::response_parser<http::buffer_body>;

  /// Begins a step and waits for its end: only asynchronous ones have a limit of time.
  Error step(const Terms& terms, const std::function<void(const Done&)>& begin) {
    using Clock = std::chrono::steady_clock;
    if (is_late(terms)) return beast::error::timeout;  // however often a byte comes
    Error error;
    Clock::duration patience = terms.patience;
    if (terms.until) patience = std::clamp<Clock::duration>(*terms.until - Clock::now(), std::chrono::milliseconds(1), patience);
    bytes_->socket().expires_after(patience);
    begin([&error](const Error& happened, std::size_t) { error = happened; });
    context_.restart();
    while (terms.stopped && !context_.stopped() && !terms.stopped()) context_.run_for(kBetweenLooks);
    if (terms.stopped && !context_.stopped()) bytes_->socket().close();
    context_.run();
    return error;
  }

  /// Why it is not whole.
  std::string take_body(const Terms& terms, Parser& parser, const Take& take) {
    const auto piece = std::make_unique<char[]>(kPiece);
    while (!parser.is_done()) {
      auto& body = parser.get().body();
      body.data = piece.get();
      body.size = kPiece;
      const Error error = step(terms, [&](const Done& done) { http::async_read_some(*bytes_, buffer_, parser, done); });
      const std::size_t count = kPiece - body.size;
      if (count > 0 && !take({piece.get(), count})) return "it was broken off here";
      if (error && error != http::error::need_buffer) return failed("it broke off", error).trouble;
    }
    return {};
  }

  asio::io_context context_{1};
  std::unique_ptr<Bytes> bytes_;
  bool can_go_on_ = false;
  beast::flat_buffer buffer_;  ///< what came behind what was read
};

namespace {

/// wire: becomes the connection.
Got get_anew(std::unique_ptr<HttpWire>& wire, const Origin& origin, const std::string& target, const Take& take,
             const Terms& terms, Keep keep) {
  wire = std::make_unique<HttpWire>(origin.secure);
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
