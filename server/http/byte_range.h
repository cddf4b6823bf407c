#pragma once
// Ranges of bytes (RFC 9110, 14): which part of an answer a client asks for, and the answer cut to it.
#include <cstdint>

#include "server/http/message.h"

namespace cordillera::server {

/// Bytes from first on, size of them; at least one.
struct ByteRange {
  std::uint64_t first = 0, size = 0;
};

/// What a request's Range is of something with so many bytes and this tag.
struct Wanted {
  enum class What : std::uint8_t { whole, part, nothing } what = What::whole;
  ByteRange part;
};
/// The whole where there is no Range, where it is not of bytes or cannot be read, where it names several parts, and where
/// If-Range names another content. Nothing: it begins behind the end.
Wanted wanted_part(const Request& request, std::uint64_t size, const std::string& etag);

/// "bytes 0-99/1000".
std::string content_range(const ByteRange& part, std::uint64_t size);
/// 416, with the size.
Response no_such_part(std::uint64_t size);

/// A GET's 200 of bytes that are at hand, with ETag and Accept-Ranges: 206 of the part, or 416.
Response cut_to_range(const Request& request, Response response);

}  // namespace cordillera::server
