#include "server/access/safe_headers.h"

#include <string_view>

namespace cordillera::server::access {
namespace {

// The viewer: its own scripts; WebAssembly and workers from blobs, which CesiumJS makes; styles that it puts on elements; imagery
// from wherever the user names it. Nobody else's page may hold it in a frame: it may have a token.
// A library inside CesiumJS evaluates strings of its own as it loads; what it evaluates never comes from outside.
constexpr const char* kPage =
    "default-src 'none'; script-src 'self' 'unsafe-eval' blob:; worker-src 'self' blob:; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob: https: http:; connect-src 'self' data: blob: https: http:; font-src 'self' data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self'";

}  // namespace

void add_safe_headers(Response& response) {
  response.set("X-Content-Type-Options", "nosniff");
  const std::string type = response.header("Content-Type");
  const std::string_view is = type;
  // Scripts take the page's policy, workers that of their own file.
  if (!is.starts_with("text/html") && !is.starts_with("text/javascript") && !is.starts_with("image/svg") &&
      !is.starts_with("application/xml"))
    return;
  if (response.header("Content-Security-Policy").empty()) response.set("Content-Security-Policy", kPage);
  // Servers of imagery want to know whose page asks; the path, which may name a private dataset, is not theirs to know.
  response.set("Referrer-Policy", "strict-origin-when-cross-origin");
}

}  // namespace cordillera::server::access
