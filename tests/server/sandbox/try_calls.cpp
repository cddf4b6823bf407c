// Every system call, by its number.
#include <linux/futex.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "probe.h"
#include "tests/sanitized.h"

namespace cordillera::probe {
namespace {

constexpr int kLast = 511;  // x32's own numbers begin there
/// uretprobe and uprobe are no calls: a newer kernel lets no filter see them, and ends whoever makes them.
constexpr int kFirstTrap = 335, kLastTrap = 336;

std::atomic<int> g_signals{0};

/// A thread of the call's own, which a permitted one ends or stops.
long in_a_thread(int number) {
  std::atomic<long> result{0};
  std::atomic<int> error{0};
  std::atomic<pid_t> id{0};
  std::atomic<bool> over{false};
  std::thread thread([&, number] {
    id = static_cast<pid_t>(syscall(SYS_gettid));
    if (number == SYS_exit) over = true;  // there is no later
    result = syscall(number, 0);
    error = errno;
    over = true;
  });
  while (!over) {
    if (number == SYS_pause && id != 0) syscall(SYS_tgkill, getpid(), id.load(), SIGUSR1);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  // ThreadSanitizer waits for good for a thread that ended behind its back.
  if (kSanitized && number == SYS_exit)
    thread.detach();
  else
    thread.join();
  errno = error;
  return result;
}

long tried(int number) {
  int word = 0;
  switch (number) {
    case SYS_exit:
    case SYS_pause: return in_a_thread(number);
    case SYS_futex: return syscall(SYS_futex, &word, FUTEX_WAKE, 0, nullptr, nullptr, 0);  // an unknown operation is ENOSYS too
    case SYS_fork:
    case SYS_vfork: {
      const long made = syscall(number);
      if (made == 0) _exit(0);
      return made;
    }
    default: return syscall(number, -1L, -1L, -1L, -1L, -1L, -1L);
  }
}

}  // namespace

void try_calls(Findings& findings) {
  struct sigaction on_signal {};
  on_signal.sa_handler = [](int) { ++g_signals; };
  sigaction(SIGUSR1, &on_signal, nullptr);
  for (int number = 0; number <= kLast; ++number) {
    // These two are seen otherwise: a handler that came back, and a process that ended by itself.
    if (number == SYS_rt_sigreturn || number == SYS_exit_group) continue;
    if (number >= kFirstTrap && number <= kLastTrap) continue;
    errno = 0;
    const long result = tried(number);
    const int error = errno;
    if (number == SYS_umask && result >= 0) umask(static_cast<mode_t>(result));
    errno = error;
    findings.call(number, result);
  }
  errno = EPERM;
  findings.call(SYS_rt_sigreturn, g_signals > 0 ? 0 : -1);
}

}  // namespace cordillera::probe
