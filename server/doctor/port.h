#pragma once
// Whether an address can be listened on.
#include <string>

namespace cordillera::server::doctor {

/// Why not; empty: it can. listen: HOST:PORT. Listens for a moment and answers nobody.
std::string cannot_listen(const std::string& listen);

}  // namespace cordillera::server::doctor
