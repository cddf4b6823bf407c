#pragma once
// Which bodies are compressed, and how: answers for clients that accept it, and what clients send.
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "proto/lru.h"
#include "proto/result.h"
#include "server/http/message.h"

namespace cordillera::server::front {

/// Compresses documents for clients that accept it. Thread-safe.
class ContentCoder {
 public:
  /// What mark_variants marked may change its bytes here.
  void encode(const Request& request, Response& response);

 private:
  std::shared_ptr<const std::string> kept(const std::string& name, const std::function<std::string()>& make);

  /// For answers that name no other place: the viewer's and the service's own, of which there are few.
  proto::Lru<std::string, std::shared_ptr<const std::string>> kept_{std::size_t{16} << 20};
};

/// What a client may say as Content-Encoding, besides nothing and identity.
inline constexpr const char* kCodings = "gzip, deflate, br";
/// Why the request's Content-Encoding is refused.
std::optional<proto::Problem> coding_problem(const Request& request);

/// Reads a body as it was before its Content-Encoding, which coding_problem lets through. A compressed body that stops before the
/// end that its coding marks did not come to its end. encoded: the body as it comes. misread: see Request.
using BodyReader = std::function<bool(const Request::Sink& sink)>;
BodyReader decoding(const std::string& content_encoding, BodyReader encoded, std::shared_ptr<bool> misread = nullptr);

}  // namespace cordillera::server::front
