// The bytes of a connection: head, target and body framing, in one piece and byte by byte; both ways must come to the same. Then
// what is made of headers, and the body as it was before it was compressed. The same bytes as what a host that rasters are
// fetched from says of a part.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "server/access/client_address.h"
#include "server/api/public_address.h"
#include "server/fetch/ranged_source.h"
#include "server/front/content_coding.h"
#include "server/front/message/body_framing.h"
#include "server/front/message/head.h"
#include "server/front/message/target.h"
#include "server/http/byte_range.h"
#include "server/http/request_id.h"

using namespace cordillera::server;
using namespace cordillera::server::front;

namespace {

struct Body {
  std::string bytes;
  bool done = false, broken = false;
};

Body body_of(const Head& head, std::string_view bytes, std::size_t piece) {
  BodyFraming framing(head);
  Body body;
  for (std::size_t at = 0; at < bytes.size() && !framing.done() && !framing.broken();) {
    const std::size_t used = framing.take(bytes.substr(at, piece), &body.bytes);
    if (used > piece || (used == 0 && !framing.done() && !framing.broken())) __builtin_trap();
    at += used;
  }
  body.done = framing.done();
  body.broken = framing.broken();
  return body;
}

bool is_plain(std::string_view text) {
  for (const char c : text) {
    if (c <= ' ' || c == '"' || c == '\\' || c == 0x7f) return false;
  }
  return true;
}

/// What goes into answers, logs and documents must not carry what a client wrote around it.
void read_headers(Request request) {
  request.client = "10.0.0.1";
  if (!access::plain_address(access::client_address(request, {"10.0.0.1", "10.0.0.2"}))) __builtin_trap();
  if (!is_plain(request_id_of(request))) __builtin_trap();
  request.path.assign(1, '/');
  if (!is_plain(public_folder(request))) __builtin_trap();
  (void)access::is_loopback(access::host_of(request.header("host").value_or("")));
}

/// A reader that has enough ends a body that grows and grows.
void decompress(const Request& request, const std::string& body) {
  constexpr std::size_t kEnough = std::size_t{1} << 20;
  std::size_t size = 0;
  const auto reader =
      decoding(request.header("content-encoding").value_or(""), [&body](const Request::Sink& sink) { return sink(body); });
  const bool whole = reader([&size](std::string_view piece) { return (size += piece.size()) <= kEnough; });
  if (whole && size > kEnough) __builtin_trap();
}

/// A part is within what it is of, also where numbers are as large as they can be, and is read again as it is written.
void read_part(std::string_view text) {
  updates::Got head;
  head.status = 206;
  head.etag = "\"one\"";
  head.range = text;
  const auto part = updates::read_content_range(head.range);
  if (updates::can_be_ranged(head) && (!part || part->first != 0 || part->count > updates::kRangeBlock_bytes)) __builtin_trap();
  if (!part) return;
  const auto& [first, count, total] = *part;
  if (count == 0 || first >= total || count > total - first) __builtin_trap();
  const auto again = updates::read_content_range(content_range({first, count}, total));
  if (!again || again->first != first || again->count != count || again->total != total) __builtin_trap();
}

/// And what a client asks for is within what there is.
void want_part(const Request& request) {
  for (const std::uint64_t size : {std::uint64_t{0}, std::uint64_t{1000}, ~std::uint64_t{0}}) {
    const Wanted wanted = wanted_part(request, size, "\"one\"");
    const auto& [first, count] = wanted.part;
    if (wanted.what == Wanted::What::part && (count == 0 || first >= size || count > size - first)) __builtin_trap();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (const auto target = read_target(bytes)) {
    if (target->path.find('\0') != std::string::npos) __builtin_trap();
  }
  read_part(bytes);
  const front::HttpLimits limits;
  HeadScan whole, slow;
  const auto state = whole.look(bytes, limits);
  auto slowly = HeadScan::State::more;
  for (std::size_t n = 1; n <= size && slowly == HeadScan::State::more; ++n) slowly = slow.look(bytes.substr(0, n), limits);
  if (slowly == HeadScan::State::whole && (state != slowly || whole.size() != slow.size())) __builtin_trap();
  if (state != HeadScan::State::whole) return 0;
  const auto head = read_head(bytes.substr(0, whole.size()), limits);
  if (!head) return 0;
  // What comes at once may be whole where slow bytes are refused earlier for their number of lines; what is accepted is so both
  // ways.
  if (state != slowly) __builtin_trap();
  const std::string_view rest = bytes.substr(whole.size());
  const Body one = body_of(*head, rest, rest.size() + 1), many = body_of(*head, rest, 1);
  if (one.bytes != many.bytes || one.done != many.done) __builtin_trap();
  // A line of chunks that comes slowly is looked at when it is whole: it may be refused later, and never sooner.
  if (many.broken && !one.broken) __builtin_trap();
  read_headers(head->request);
  read_part(head->request.header("content-range").value_or(""));
  want_part(head->request);
  decompress(head->request, one.bytes);
  return 0;
}
