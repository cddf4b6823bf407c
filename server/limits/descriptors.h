#pragma once
// Descriptors of this process: every connection, upload and open dataset takes some.
#include <cstddef>
#include <string>

#include "server/options/options.h"

namespace cordillera::server::limits {

/// As many as the system lets us have. Returns how many.
std::size_t raise_descriptor_limit();

/// Lowers the numbers of connections, uploads and open datasets until all of them together have descriptors. A sentence that says so;
/// empty: there are enough.
std::string fit_to_descriptors(ServeSettings& settings, std::size_t descriptors);

}  // namespace cordillera::server::limits
