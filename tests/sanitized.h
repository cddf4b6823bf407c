#pragma once
// Whether a sanitizer looks on. It makes everything slow and large, and ends a process that gets no memory by itself.

namespace cordillera {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace cordillera
