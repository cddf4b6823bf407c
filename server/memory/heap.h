#pragma once
// The C library's heap, so that a service that was busy once is not large for ever.
#include <cstddef>

namespace cordillera::server {

/// Large blocks go back to the system as they are freed, threads share a few arenas, and a reserve is laid aside. To be called
/// before the first thread.
void set_up_heap();

/// Whoever first finds no memory gets std::bad_alloc, and the reserve becomes free for what has to be done on the way out:
/// destructors that allocate end the program where they cannot. Lays it aside again where it is gone.
void keep_reserve();

/// What one request may need in small pieces. Not every library survives that a small piece is refused (protobuf's output does
/// not), so nothing is begun with less.
inline constexpr std::size_t kForARequest_bytes = std::size_t{4} << 20;
/// For the stack of a thread.
inline constexpr std::size_t kForAThread_bytes = std::size_t{8} << 20;

/// With less a service does not begin to listen: two threads more, some requests at a time, and what it keeps of them.
inline constexpr std::size_t kToListen_bytes = 2 * kForAThread_bytes + 4 * kForARequest_bytes;

/// Whether so much would be given now. Always true, and cheap, where the system refuses no memory.
bool has_memory(std::size_t bytes);
/// Whether a thread more leaves enough for a request.
inline bool has_memory_for_a_thread() { return has_memory(kForAThread_bytes + kForARequest_bytes); }

/// Gives free memory back to the system where there is much of it. Cheap where there is not.
void trim_heap();

}  // namespace cordillera::server
