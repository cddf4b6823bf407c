#pragma once
// A signal that asks this process to stop what it works on: what is done is kept.
#include <atomic>
#include <csignal>
#include <initializer_list>

namespace cordillera::server {

inline std::atomic<bool> g_asked_to_stop{false};  ///< set by a signal handler, which can reach nothing else

/// From here on these signals set it, and do nothing else.
inline void stop_on(std::initializer_list<int> signals) {
  for (const int number : signals) std::signal(number, [](int) { g_asked_to_stop = true; });
}

}  // namespace cordillera::server
