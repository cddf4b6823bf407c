#include "server/front/content_coding.h"

#include <httplib.h>

#include <memory>

#include "server/gzip.h"

namespace cordillera::server::front {
namespace {

constexpr std::size_t kWorthIt = 128;  // bytes; less would hardly shrink

std::string compressed(httplib::detail::compressor& compressor, const std::string& bytes) {
  std::string out;
  const bool done = compressor.compress(bytes.data(), bytes.size(), true, [&](const char* piece, std::size_t count) {
    out.append(piece, count);
    return true;
  });
  return done ? out : std::string();
}

std::string compressed(std::string_view coding, const std::string& bytes) {
  if (coding == "br") {
    httplib::detail::brotli_compressor compressor;
    return compressed(compressor, bytes);
  }
  httplib::detail::gzip_compressor compressor;
  return compressed(compressor, bytes);
}

std::unique_ptr<httplib::detail::decompressor> decompressor(const std::string& coding) {
  if (coding == "gzip" || coding == "x-gzip" || coding == "deflate") return std::make_unique<httplib::detail::gzip_decompressor>();
  if (coding == "br") return std::make_unique<httplib::detail::brotli_decompressor>();
  return nullptr;
}

}  // namespace

void ContentCoder::encode(const Request& request, Response& response) {
  const bool reads = request.method == "GET" || request.method == "HEAD";
  if (!reads || response.body.size() < kWorthIt || !is_compressible(response.header("Content-Type"))) return;
  if (!response.header("Content-Encoding").empty()) return;
  const std::string tag = response.header("ETag");
  const bool keep = response.status == 200 && !tag.empty();
  const char* coding = keep && accepts(request, "br") ? "br" : accepts(request, "gzip") ? "gzip" : nullptr;
  if (coding == nullptr) return;
  const std::string name = coding + tag;
  std::string bytes;
  if (auto kept = keep ? kept_.find(name) : std::nullopt) {
    bytes = std::move(*kept);
  } else {
    bytes = compressed(coding, response.body);
    if (keep && !bytes.empty()) kept_.keep(name, bytes, bytes.size() + name.size());
  }
  if (bytes.empty()) return;
  response.body = std::move(bytes);
  response.set("Content-Encoding", coding);
}

BodyReader decoding(const std::string& content_encoding, BodyReader encoded) {
  return [content_encoding, encoded = std::move(encoded)](const Request::Sink& sink) {
    const auto decoder = decompressor(content_encoding);
    if (!decoder) return encoded(sink);
    bool fits = decoder->is_valid();
    const bool ended = encoded([&](std::string_view piece) {
      fits = fits && decoder->decompress(piece.data(), piece.size(), [&](const char* bytes, std::size_t count) { return sink({bytes, count}); });
      return fits;
    });
    return ended && fits;
  };
}

}  // namespace cordillera::server::front
