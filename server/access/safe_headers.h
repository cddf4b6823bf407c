#pragma once
// What browsers are told about an answer, so that it is taken for nothing else than it is.
#include "server/http/message.h"

namespace cordillera::server::access {

/// A page of ours with a map library in it: its own script, and libraries of named versions from one host, of which the page
/// names the hashes. It is a file that was installed: nothing of a request stands in it.
inline constexpr const char* kLibraryPage =
    "default-src 'none'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob: https://cdn.jsdelivr.net/npm/; worker-src 'self' "
    "blob:; "
    "style-src 'self' 'unsafe-inline' https://cdn.jsdelivr.net/npm/; img-src 'self' data: blob: https: http:; "
    "connect-src 'self' data: blob: https: http:; font-src 'self' data:; base-uri 'none'; form-action 'self'; frame-ancestors "
    "'self'";

/// A policy that the answer has already stays.
void add_safe_headers(Response& response);

}  // namespace cordillera::server::access
