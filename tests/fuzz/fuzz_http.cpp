// The bytes of a connection: head, target and body framing, in one piece and byte by byte; both ways must come to the same.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "server/front/body_framing.h"
#include "server/front/head.h"
#include "server/front/target.h"

using namespace cordillera::server::front;

namespace {

std::string body_of(const Head& head, std::string_view bytes, std::size_t piece, bool* done) {
  BodyFraming framing(head);
  std::string body;
  for (std::size_t at = 0; at < bytes.size() && !framing.done() && !framing.broken();) {
    const std::size_t used = framing.take(bytes.substr(at, piece), &body);
    if (used > piece || (used == 0 && !framing.done() && !framing.broken())) __builtin_trap();
    at += used;
  }
  *done = framing.done();
  return framing.broken() ? "" : body;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (const auto target = read_target(bytes)) {
    if (target->path.find('\0') != std::string::npos) __builtin_trap();
  }
  const Limits limits;
  HeadScan whole, slow;
  const auto state = whole.look(bytes, limits);
  auto slowly = HeadScan::State::more;
  for (std::size_t n = 1; n <= size && slowly == HeadScan::State::more; ++n) slowly = slow.look(bytes.substr(0, n), limits);
  if (slowly == HeadScan::State::whole && (state != slowly || whole.size() != slow.size())) __builtin_trap();
  if (state != HeadScan::State::whole) return 0;
  const auto head = read_head(bytes.substr(0, whole.size()), limits);
  if (!head) return 0;
  // What comes at once may be whole where slow bytes are refused earlier for their number of lines; what is accepted is so both ways.
  if (state != slowly) __builtin_trap();
  const std::string_view rest = bytes.substr(whole.size());
  bool one = false, many = false;
  if (body_of(*head, rest, rest.size() + 1, &one) != body_of(*head, rest, 1, &many) || one != many) __builtin_trap();
  return 0;
}
