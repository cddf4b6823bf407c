#pragma once
// A signal that asks this process to stop what it works on: what is done is kept.
#include <atomic>
#include <csignal>
#include <initializer_list>

namespace cordillera::server {

inline std::atomic<bool> g_asked_to_stop{false};  ///< set by a signal handler, which can reach nothing else

/// What a signal does the second time. ends: the process, as it does others, for who sits before it: a tile may take long, and
/// does not ask whether to stop. What was done before is kept all the same.
enum class SecondTime { asks_again, ends };

/// From here on these signals set it, and do nothing else. A hangup that is ignored stays so: that is what nohup is for.
inline void stop_on(std::initializer_list<int> signals, SecondTime second) {
  struct sigaction action = {};
  action.sa_handler = [](int) { g_asked_to_stop = true; };
  action.sa_flags = SA_RESTART | (second == SecondTime::ends ? static_cast<int>(SA_RESETHAND) : 0);
  for (const int number : signals) {
    struct sigaction before = {};
    if (number == SIGHUP && sigaction(number, nullptr, &before) == 0 && before.sa_handler == SIG_IGN) continue;
    sigaction(number, &action, nullptr);
  }
}

}  // namespace cordillera::server
