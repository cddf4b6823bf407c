#pragma once
// Descriptors of this process: every connection, upload and open dataset takes some.
#include <algorithm>
#include <cstddef>
#include <string>

#include "server/options/options.h"

namespace cordillera::server::limits {

/// As many as the system lets us have. Returns how many.
std::size_t raise_descriptor_limit();

/// Where stdin, stdout or stderr is closed, a file that is opened would take its place, and be read or written as if it were
/// that. What this puts there can be neither read nor written, as a closed one.
void hold_standard_descriptors();

/// Sockets beyond so many connections that may be open for a moment: of clients that are told why they are refused.
constexpr std::size_t refused_sockets(std::size_t connections) { return std::clamp<std::size_t>(connections / 8, 1, 32); }

/// Lowers the numbers of connections, uploads and open datasets until all of them together have descriptors. A sentence that says
/// so; empty: there are enough.
std::string fit_to_descriptors(ServeSettings& settings, std::size_t descriptors);

}  // namespace cordillera::server::limits
