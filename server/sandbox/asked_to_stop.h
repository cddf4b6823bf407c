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

/// The same for who sits before it: the second time a signal ends the process, as it does others. A tile may take long, and does
/// not ask whether to stop; what is begun anew goes on from what was done before.
inline void stop_on_and_end_on_the_next(std::initializer_list<int> signals) {
  for (const int number : signals) {
    std::signal(number, [](int again) {
      g_asked_to_stop = true;
      std::signal(again, SIG_DFL);
    });
  }
}

}  // namespace cordillera::server
