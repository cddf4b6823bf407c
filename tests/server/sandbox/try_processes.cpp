// Other processes, the terminal, and the machine.
#include <fcntl.h>
#include <linux/sched.h>
#include <mqueue.h>
#include <sched.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/ipc.h>
#include <sys/mman.h>
#include <sys/msg.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/sem.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/timex.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <cstdlib>
#include <iterator>

#include "probe.h"

namespace cordillera::probe {
namespace {

/// A child that was made after all ends at once.
long forked(long pid) {
  if (pid == 0) _exit(0);
  return pid;
}

void try_service(Findings& findings) {
  const pid_t service = getppid();
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  cpu_set_t processors;
  CPU_ZERO(&processors);
  CPU_SET(0, &processors);
  const sched_param usual{};
  siginfo_t words{};
  words.si_code = SI_QUEUE;
  findings.attack("a signal to the service", kill(service, SIGCONT));
  findings.attack("a signal to everyone", kill(-1, 0));
  findings.attack("a signal to the service's thread", syscall(SYS_tgkill, service, service, SIGCONT));
  findings.attack("a signal by tkill", syscall(SYS_tkill, service, SIGCONT));
  findings.attack("a queued signal", syscall(SYS_rt_sigqueueinfo, service, SIGCONT, &words));
  findings.attack("a queued signal to a thread", syscall(SYS_rt_tgsigqueueinfo, service, service, SIGCONT, &words));
  findings.attack("a descriptor of the service", syscall(SYS_pidfd_open, service, 0));
  findings.attack("a signal by descriptor", syscall(SYS_pidfd_send_signal, 0, SIGCONT, nullptr, 0));
  findings.attack("signals by a descriptor's owner", fcntl(2, F_SETOWN, service));
  findings.attack("which signal that is", fcntl(2, F_SETSIG, SIGCONT));
  findings.attack("the service's limits", prlimit(service, RLIMIT_NOFILE, nullptr, &limit));
  findings.attack("other limits for the service", prlimit(service, RLIMIT_NOFILE, &limit, nullptr));
  findings.attack("the service's priority", setpriority(PRIO_PROCESS, service, 0));
  findings.attack("the service's processors", sched_setaffinity(service, sizeof processors, &processors));
  findings.attack("the service's scheduling", sched_setscheduler(service, SCHED_OTHER, &usual));
  findings.attack("the service's place at the disk", syscall(SYS_ioprio_set, 1, service, 0));
  char byte = 0;
  const iovec here{&byte, 1}, there{&byte, 1};
  findings.attack("the service's memory by process_vm_readv", process_vm_readv(service, &here, 1, &there, 1, 0));
  findings.attack("the service's memory by process_vm_writev", process_vm_writev(service, &here, 1, &there, 1, 0));
  findings.attack("to trace the service", ptrace(PTRACE_SEIZE, service, nullptr, nullptr));
  findings.attack("to compare with the service", syscall(SYS_kcmp, getpid(), service, 0, 0, 0));
}

void try_itself(Findings& findings) {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  findings.attack("limits of its own", setrlimit(RLIMIT_NOFILE, &limit));
  const itimerval never{};
  findings.attack("another clock by setitimer", setitimer(ITIMER_REAL, &never, nullptr));
  timer_t timer{};
  sigevent event{};
  event.sigev_notify = SIGEV_NONE;
  findings.attack("another clock by timer_create", timer_create(CLOCK_MONOTONIC, &event, &timer));
  findings.attack("another session", setsid());
  findings.attack("another user", setuid(getuid()));
}

}  // namespace

void try_secrets(Findings& findings) {
  std::ifstream file("/proc/self/environ");
  const std::string own{std::istreambuf_iterator<char>(file), {}};
  errno = EPERM;
  const bool known = getenv("AWS_SECRET_ACCESS_KEY") != nullptr || own.find("AWS_SECRET") != own.npos;
  findings.attack("the operator's secrets", known ? 0 : -1);
}

void try_processes(Findings& findings) {
  try_service(findings);
  try_itself(findings);
  findings.attack("a process by fork", forked(syscall(SYS_fork)));
  findings.attack("a process by clone", forked(syscall(SYS_clone, SIGCHLD, nullptr, nullptr, nullptr, nullptr)));
  clone_args arguments{};
  arguments.exit_signal = SIGCHLD;
  findings.attack("a process by clone3", forked(syscall(SYS_clone3, &arguments, sizeof arguments)));
  for (const int family : {AF_UNIX, AF_INET, AF_INET6, AF_NETLINK, AF_PACKET}) {
    const int made = socket(family, SOCK_DGRAM, 0);
    findings.attack(("a socket of family " + std::to_string(family)).c_str(), made);
    if (made >= 0) close(made);
  }
}

void try_machine(Findings& findings) {
  char letter = 'x', name[] = "/bin/true";
  char* words[] = {name, nullptr};
  findings.attack("another program", execv(name, words));
  findings.attack("another program by execveat", syscall(SYS_execveat, AT_FDCWD, name, words, nullptr, 0));
  findings.attack("a key pressed at stderr's terminal", ioctl(2, TIOCSTI, &letter));
  findings.attack("a key pressed at stdin's terminal", ioctl(0, TIOCSTI, &letter));
  letter = 3;
  findings.attack("text pasted into a console", ioctl(2, TIOCLINUX, &letter));
  findings.attack("a command with bits above its 32", syscall(SYS_ioctl, 2, 0x100000000L | TIOCSTI, &letter));
  const int terminal = open("/dev/tty", O_RDWR | O_CLOEXEC);
  if (terminal < 0 && errno == ENXIO) errno = EPERM;  // a session without one
  findings.attack("the terminal", terminal);
  findings.attack("shared memory", shmget(IPC_PRIVATE, 4096, IPC_CREAT | 0600));
  findings.attack("semaphores", semget(IPC_PRIVATE, 1, IPC_CREAT | 0600));
  findings.attack("a queue of messages", msgget(IPC_PRIVATE, IPC_CREAT | 0600));
  findings.attack("a named queue of messages", syscall(SYS_mq_open, "cordillera-probe", O_CREAT | O_RDWR, 0600, nullptr));
  findings.attack("memory taken from the machine", madvise(nullptr, 4096, MADV_HWPOISON));
  findings.attack("other namespaces", unshare(CLONE_NEWUSER));
  constexpr long kThread = CLONE_VM | CLONE_FS | CLONE_FILES | CLONE_SIGHAND | CLONE_THREAD | CLONE_SYSVSEM;
  findings.attack("a thread in another namespace",
                  syscall(SYS_clone, kThread | CLONE_NEWNET, nullptr, nullptr, nullptr, nullptr));
  findings.attack("the kernel's log", syscall(SYS_syslog, 10, nullptr, 0));
  findings.attack("a mount", syscall(SYS_fsopen, "tmpfs", 0));
  findings.attack("the host's name", syscall(SYS_sethostname, "", -1L));
  findings.attack("io_uring", syscall(SYS_io_uring_setup, 1, nullptr));
  findings.attack("BPF", syscall(SYS_bpf, 0, nullptr, 0));
  findings.attack("keys", syscall(SYS_keyctl, 0, -1, 0));
  findings.attack("page faults", syscall(SYS_userfaultfd, 0));
  timex clock{};
  findings.attack("the machine's clock", clock_adjtime(CLOCK_REALTIME, &clock));
#ifdef __x86_64__
  findings.attack("a call by its x32 number", syscall(0x40000000L | SYS_getpid));
#endif
}

}  // namespace cordillera::probe
