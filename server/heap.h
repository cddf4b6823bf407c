#pragma once
// The C library's heap, so that a service that was busy once is not large for ever.
#include <cstddef>

namespace cordillera::server {

/// Large blocks go back to the system as they are freed, and threads share a few arenas. To be called before the first thread.
void set_up_heap();

/// Gives free memory back to the system where there is much of it. Cheap where there is not.
void trim_heap();

}  // namespace cordillera::server
