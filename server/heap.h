#pragma once
// The C library's heap, so that a service that was busy once is not large for ever.
#include <cstddef>

namespace cordillera::server {

/// Large blocks go back to the system as they are freed, threads share a few arenas, and a reserve is laid aside. To be called before the
/// first thread.
void set_up_heap();

/// Whoever first finds no memory gets std::bad_alloc, and the reserve becomes free for what has to be done on the way out: destructors that
/// allocate end the program where they cannot. Lays it aside again where it is gone and there is more memory than that.
void keep_reserve();

/// Gives free memory back to the system where there is much of it. Cheap where there is not.
void trim_heap();

}  // namespace cordillera::server
