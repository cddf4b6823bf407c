#include "server/fetch/http_get.h"

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

namespace cordillera::server::updates {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using asio::ip::tcp;
using Error = beast::error_code;
using Take = std::function<bool(std::string_view)>;
using Places = tcp::resolver::results_type;

constexpr std::uint32_t kMostHead = 64u << 10;        // a Location may hold a long signature
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

/// A connection for one answer.
template <typename Stream>
class Exchange {
 public:
  Exchange(asio::io_context& context, Stream& stream, const Terms& terms) : context_(context), stream_(stream), terms_(terms) {}

  /// Begins a step and waits for its end: only asynchronous ones have a limit of time.
  template <typename Begin>
  Error step(const Begin& begin) {
    Error error;
    beast::get_lowest_layer(stream_).expires_after(terms_.patience);
    begin([&error](const Error& happened, const auto&...) { error = happened; });
    context_.restart();
    context_.run();
    return error;
  }

  Error connect(const Places& places) {
    return step([&](auto done) { beast::get_lowest_layer(stream_).async_connect(places, done); });
  }

  Got get(const Origin& origin, const std::string& target, const Take& take) {
    http::request<http::empty_body> request(http::verb::get, target, 11);
    request.set(http::field::host, origin.authority);
    request.set(http::field::accept_encoding, "identity");
    request.set(http::field::user_agent, std::string("cordillera/") + CORDILLERA_VERSION);
    request.set(http::field::connection, "close");
    if (!terms_.etag.empty()) request.set(http::field::if_none_match, terms_.etag);
    if (const Error error = step([&](auto done) { http::async_write(stream_, request, done); }))
      return failed("it takes no request", error);
    beast::flat_buffer buffer;
    for (int interim = 0; interim <= kMostInterim; ++interim) {
      http::response_parser<http::buffer_body> parser;
      parser.header_limit(kMostHead);
      parser.body_limit(std::numeric_limits<std::uint64_t>::max());  // take knows it; in Boost 1.74 none is less than any length
      if (const Error error = step([&](auto done) { http::async_read_header(stream_, buffer, parser, done); }))
        return failed("it sends no answer that can be read", error);
      const auto& head = parser.get();
      if (head.result_int() / 100 == 1) continue;
      Got got;
      got.status = static_cast<int>(head.result_int());
      const auto text = [&](http::field name) { return std::string(head[name].data(), head[name].size()); };
      got.location = text(http::field::location);
      got.etag = text(http::field::etag);
      got.modified = text(http::field::last_modified);
      got.length = parser.content_length().value_or(0);
      if (got.status == 200) got.trouble = take_body(parser, buffer, take);
      return got;
    }
    Got got;
    got.trouble = "it begins to answer again and again";
    return got;
  }

 private:
  /// Why it is not whole.
  std::string take_body(http::response_parser<http::buffer_body>& parser, beast::flat_buffer& buffer, const Take& take) {
    const auto piece = std::make_unique<char[]>(kPiece);
    while (!parser.is_done()) {
      auto& body = parser.get().body();
      body.data = piece.get();
      body.size = kPiece;
      const Error error = step([&](auto done) { http::async_read_some(stream_, buffer, parser, done); });
      const std::size_t count = kPiece - body.size;
      if (count > 0 && !take({piece.get(), count})) return "it was broken off here";
      if (error && error != http::error::need_buffer) return failed("it broke off", error).trouble;
    }
    return {};
  }

  asio::io_context& context_;
  Stream& stream_;
  const Terms& terms_;
};

Got by_tls(asio::io_context& context, const Origin& origin, const Places& places, const std::string& target, const Take& take, const Terms& terms) {
  asio::ssl::context trust(asio::ssl::context::tls_client);
  trust.set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 | asio::ssl::context::no_tlsv1_1);
  trust.set_default_verify_paths();
  trust.set_verify_mode(asio::ssl::verify_peer);
  beast::ssl_stream<beast::tcp_stream> stream(context, trust);
  stream.set_verify_callback(asio::ssl::host_name_verification(origin.host));
  Error no_number;
  asio::ip::make_address(origin.host, no_number);
  if (no_number && SSL_set_tlsext_host_name(stream.native_handle(), origin.host.c_str()) != 1)
    return failed("its name cannot be asked for", no_number);
  Exchange<beast::ssl_stream<beast::tcp_stream>> exchange(context, stream, terms);
  if (const Error error = exchange.connect(places)) return failed("no connection could be made", error);
  if (const Error error = exchange.step([&](auto done) { stream.async_handshake(asio::ssl::stream_base::client, done); }))
    return failed("no TLS could be agreed on with it", error);
  return exchange.get(origin, target, take);
}

Got in_plain(asio::io_context& context, const Origin& origin, const Places& places, const std::string& target, const Take& take, const Terms& terms) {
  beast::tcp_stream stream(context);
  Exchange<beast::tcp_stream> exchange(context, stream, terms);
  if (const Error error = exchange.connect(places)) return failed("no connection could be made", error);
  return exchange.get(origin, target, take);
}

}  // namespace

Got http_get(const std::string& address, const Take& take, const Terms& terms) {
  const auto [host, target] = host_and_target(address);
  const Origin origin = origin_of(host);
  asio::io_context context(1);
  Error error;
  const auto places = tcp::resolver(context).resolve(origin.host, origin.port, tcp::resolver::numeric_service, error);
  if (error) return failed("its host is not known", error);
  return (origin.secure ? by_tls : in_plain)(context, origin, places, target, take, terms);
}

}  // namespace cordillera::server::updates
