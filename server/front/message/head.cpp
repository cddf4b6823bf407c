#include "server/front/message/head.h"

#include <algorithm>
#include <cstring>

#include "proto/letters.h"
#include "proto/numbers.h"
#include "proto/parts.h"
#include "server/front/message/beast.h"
#include "server/front/message/target.h"

namespace cordillera::server::front {
namespace {

using proto::Problem;

Problem invalid(const std::string& what) {
  return {"request-invalid", "the request is not valid HTTP/1.1: " + what,
          "a request line, headers and a body as RFC 9112 has them", ""};
}

Problem unknown_method(std::string_view method) {
  return {"method-unknown", "this service has no method " + std::string(method.substr(0, 20)),
          "GET, HEAD, POST, PUT, PATCH, DELETE or OPTIONS", ""};
}

Problem target_too_long(const HttpLimits& limits) {
  return {"uri-too-long", "the address is too long",
          "an address of at most " + std::to_string(limits.target_bytes >> 10) + " KiB", ""};
}

Problem head_too_large(const HttpLimits& limits) {
  return {"head-too-large", "the request's headers are too large",
          "at most " + std::to_string(limits.fields) + " headers of " + std::to_string(limits.head_bytes >> 10) + " KiB in all",
          ""};
}

bool is_known_method(std::string_view method) {
  static constexpr std::string_view kKnown[] = {"GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH"};
  return std::find(std::begin(kKnown), std::end(kKnown), method) != std::end(kKnown);
}

/// A word of a comma-separated list.
bool lists(const Request& request, const char* header, std::string_view word) {
  const auto found = request.headers.find(header);
  return found != request.headers.end() &&
         proto::each_part(found->second, ',', [&](std::string_view item) { return proto::lower(proto::trimmed(item)) == word; });
}

/// Beast takes neither, and says of both that the version is bad.
std::optional<Problem> check_version(std::string_view bytes) {
  const std::string_view line = bytes.substr(0, bytes.find('\r')), word = line.substr(line.rfind(' ') + 1);
  const bool version =
      word.size() == 8 && word.starts_with("HTTP/") && proto::is_digit(word[5]) && word[6] == '.' && proto::is_digit(word[7]);
  if (!version || word == "HTTP/1.1" || word == "HTTP/1.0") return std::nullopt;
  return Problem{"http-version", "the request is " + std::string(word), "HTTP/1.1 or HTTP/1.0", ""};
}

/// authority: of an absolute target.
std::optional<Problem> read_request_line(const RawHead& raw, const HttpLimits& limits, Head& head, std::string& authority) {
  if (!is_known_method(raw.method)) return unknown_method(raw.method);
  if (raw.target.size() > limits.target_bytes) return target_too_long(limits);
  auto read = read_target(raw.target);
  if (!read || (raw.target == "*" && raw.method != "OPTIONS")) return invalid("the address is none");
  head.old = raw.old;
  head.request.method = raw.method;
  head.request.path = std::move(read->path);
  head.request.query = std::move(read->query);
  authority = std::move(read->authority);
  return std::nullopt;
}

std::optional<Problem> read_fields(const RawHead& raw, Head& head) {
  for (const auto& [name, value] : raw.fields) {
    auto [place, fresh] = head.request.headers.try_emplace(proto::lower(name), value);
    if (fresh) continue;
    if (place->first == "content-length") return invalid("Content-Length stands there twice");
    if (place->first == "host") return invalid("Host stands there twice");
    place->second.append(", ").append(value);
  }
  return std::nullopt;
}

std::optional<Problem> read_framing(Head& head) {
  const auto coding = head.request.header("transfer-encoding"), length = head.request.header("content-length");
  if (coding && length) return invalid("Content-Length and Transfer-Encoding exclude each other");
  if (coding) {
    if (proto::lower(*coding) != "chunked" || head.old) return invalid("the only Transfer-Encoding is chunked, of HTTP/1.1");
    head.body = Head::Body::chunked;
  }
  if (length) {
    const auto bytes = proto::number<std::uint64_t>(*length);
    if (!bytes) return invalid("Content-Length is not a number");
    head.length = *bytes;
    if (head.length > 0) head.body = Head::Body::sized;
  }
  return std::nullopt;
}

}  // namespace

HeadScan::State HeadScan::look(std::string_view bytes, const HttpLimits& limits) {
  while (at_ < bytes.size()) {
    const void* found = std::memchr(bytes.data() + at_, '\n', bytes.size() - at_);
    if (found == nullptr) break;
    const std::size_t end = static_cast<std::size_t>(static_cast<const char*>(found) - bytes.data());
    if (end == line_ || bytes[end - 1] != '\r') return State::broken;
    if (bytes[line_] == ' ' || bytes[line_] == '\t') return State::broken;  // a folded line, or what looks like one
    at_ = end + 1;
    const bool empty = end == line_ + 1;
    line_ = at_;
    if (empty && lines_ > 0) {
      size_ = at_;
      return State::whole;
    }
    // A client may end its last body with an empty line that belongs to nothing (RFC 9112, 2.2).
    if (empty && at_ > 2) return State::broken;
    if (!empty) ++lines_;
  }
  at_ = std::max(at_, bytes.size());
  too_long_ =
      bytes.size() > limits.head_bytes || (lines_ == 0 && bytes.size() > limits.target_bytes + 100) || lines_ > limits.fields + 1;
  return too_long_ ? State::broken : State::more;
}

Problem head_problem(const HeadScan& scan, const HttpLimits& limits) {
  if (!scan.too_long()) return invalid("lines end with CR and LF, both, and do not begin with a blank");
  return scan.in_first_line() ? target_too_long(limits) : head_too_large(limits);
}

proto::Result<Head> read_head(std::string_view bytes, const HttpLimits& limits) {
  if (bytes.starts_with("\r\n")) bytes.remove_prefix(2);
  if (auto problem = check_version(bytes)) return *problem;
  RawHead raw;
  if (const std::string wrong = parse_head(bytes, &raw); !wrong.empty()) return invalid(wrong);
  Head head;
  std::string authority;
  if (auto problem = read_request_line(raw, limits, head, authority)) return *problem;
  if (bytes.size() > limits.head_bytes || raw.fields.size() > limits.fields) return head_too_large(limits);
  if (auto problem = read_fields(raw, head)) return *problem;
  const auto host = head.request.header("host");
  if (!head.old && !host) return invalid("Host is missing");
  if (host && !is_authority(*host)) return invalid("Host is neither a host nor a host and its port");
  if (!authority.empty()) head.request.headers["host"] = authority;
  if (auto problem = read_framing(head)) return *problem;
  head.keep_alive = head.old ? lists(head.request, "connection", "keep-alive") : !lists(head.request, "connection", "close");
  head.expects_continue = !head.old && lists(head.request, "expect", "100-continue");
  return head;
}

}  // namespace cordillera::server::front
