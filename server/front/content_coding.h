#pragma once
// gzip and br, both ways, by cpp-httplib. The only file behind this header knows httplib.
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "pipeline/faces/lru.h"
#include "server/message.h"

namespace cordillera::server::front {

/// Compresses documents for clients that accept it. Thread-safe.
class ContentCoder {
 public:
  /// What mark_variants marked may change its bytes here. br only where a tag lets the result be kept: it takes its time.
  void encode(const Request& request, Response& response);

 private:
  pipeline::faces::Lru<std::string, std::string> kept_{std::size_t{16} << 20};
};

/// Reads a body whose Content-Encoding is gzip, deflate or br as it was before; others are handed on as they are.
/// encoded: the body as it comes.
using BodyReader = std::function<bool(const Request::Sink& sink)>;
BodyReader decoding(const std::string& content_encoding, BodyReader encoded);

}  // namespace cordillera::server::front
