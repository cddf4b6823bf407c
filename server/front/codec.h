#pragma once
// gzip, deflate and br as zlib and libbrotli have them. The only file of the front that knows either.
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace cordillera::server::front {

/// For what is compressed while a client waits: quality 5, up to a fifth larger than brotli's best and many times as quick.
std::string brotli(std::string_view bytes);

/// Reads a compressed body in pieces.
class Decoder {
 public:
  using Sink = std::function<bool(std::string_view piece)>;
  virtual ~Decoder() = default;
  /// False: the bytes are not of this coding, or go on after its end, or the sink wants no more.
  virtual bool take(std::string_view bytes, const Sink& sink) = 0;
  /// What was taken is whole: it has come to the end that the coding itself marks.
  virtual bool ended() const = 0;
};

/// coding: gzip, x-gzip, deflate or br. Null: any other.
std::unique_ptr<Decoder> decoder_of(std::string_view coding);

}  // namespace cordillera::server::front
