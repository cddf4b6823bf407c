#pragma once
// The head of a request: bytes to a Request, and how its body is framed. Stricter than many: what two programs may read in two
// ways (a length said twice, a length beside chunks, folded lines, bare line ends) lets one client put words into another's mouth
// behind a proxy, so it is refused.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "proto/result.h"
#include "server/front/message/limits.h"
#include "server/http/message.h"

namespace cordillera::server::front {

/// Looks for the end of a head in bytes that come in pieces.
class HeadScan {
 public:
  enum class State { more, whole, broken };
  /// bytes: everything so far; only what is new is looked at. broken: a line end that is none, or a head beyond the limits.
  State look(std::string_view bytes, const HttpLimits& limits);
  std::size_t size() const { return size_; }  ///< of the whole head, the empty line included
  bool in_first_line() const { return lines_ == 0; }
  bool too_long() const { return too_long_; }

 private:
  std::size_t at_ = 0, line_ = 0, size_ = 0, lines_ = 0;
  bool too_long_ = false;
};

struct Head {
  Request request;  ///< without a body to read
  enum class Body : std::uint8_t { none, sized, chunked } body = Body::none;
  std::uint64_t length = 0;  ///< of a sized body
  bool keep_alive = true;
  bool old = false;  ///< HTTP/1.0: no chunks
  bool expects_continue = false;
};

/// bytes: a whole head.
proto::Result<Head> read_head(std::string_view bytes, const HttpLimits& limits);

/// Why a head that never became whole is refused.
proto::Problem head_problem(const HeadScan& scan, const HttpLimits& limits);

}  // namespace cordillera::server::front
