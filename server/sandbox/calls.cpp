#include "server/sandbox/calls.h"

#include <fcntl.h>
#include <linux/fs.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <vector>

namespace cordillera::server::sandbox {
namespace {

// --- whatever the arguments: these reach what the process holds already, or what Landlock looks at ---

constexpr int kAllowed[] = {
    // memory of its own
    SCMP_SYS(brk),
    SCMP_SYS(munmap),
    SCMP_SYS(mremap),
    SCMP_SYS(membarrier),
    // descriptors that it has
    SCMP_SYS(read),
    SCMP_SYS(write),
    SCMP_SYS(readv),
    SCMP_SYS(writev),
    SCMP_SYS(pread64),
    SCMP_SYS(pwrite64),
    SCMP_SYS(preadv),
    SCMP_SYS(pwritev),
    SCMP_SYS(lseek),
    SCMP_SYS(close),
    SCMP_SYS(close_range),
    SCMP_SYS(dup),
    SCMP_SYS(dup2),
    SCMP_SYS(dup3),
    SCMP_SYS(fsync),
    SCMP_SYS(fdatasync),
    SCMP_SYS(ftruncate),
    SCMP_SYS(fallocate),
    SCMP_SYS(fadvise64),
    SCMP_SYS(sendfile),
    SCMP_SYS(copy_file_range),
    SCMP_SYS(poll),
    SCMP_SYS(ppoll),
    SCMP_SYS(fstat),
    SCMP_SYS(fstatfs),
    SCMP_SYS(getdents64),
    // names: Landlock says which
    SCMP_SYS(mkdir),
    SCMP_SYS(mkdirat),
    SCMP_SYS(rmdir),
    SCMP_SYS(unlink),
    SCMP_SYS(unlinkat),
    SCMP_SYS(rename),
    SCMP_SYS(renameat),
    SCMP_SYS(renameat2),
    SCMP_SYS(symlink),
    SCMP_SYS(symlinkat),
    // whether a name is there, and what it is: nothing asks Landlock, and nothing is read
    SCMP_SYS(stat),
    SCMP_SYS(lstat),
    SCMP_SYS(newfstatat),
    SCMP_SYS(statx),
    SCMP_SYS(statfs),
    SCMP_SYS(access),
    SCMP_SYS(faccessat),
    SCMP_SYS(faccessat2),
    SCMP_SYS(readlink),
    SCMP_SYS(readlinkat),
    SCMP_SYS(getcwd),
    SCMP_SYS(chdir),
    SCMP_SYS(umask),
    // threads, locks and signals within the process
    SCMP_SYS(futex),
    SCMP_SYS(set_robust_list),
    SCMP_SYS(set_tid_address),
    SCMP_SYS(rseq),
    SCMP_SYS(sched_yield),
    SCMP_SYS(rt_sigaction),
    SCMP_SYS(rt_sigprocmask),
    SCMP_SYS(rt_sigreturn),
    SCMP_SYS(sigaltstack),
    SCMP_SYS(pause),
    SCMP_SYS(restart_syscall),
    SCMP_SYS(exit),
    SCMP_SYS(exit_group),
    SCMP_SYS(sched_get_priority_max),
    SCMP_SYS(sched_get_priority_min),
    // on which processors a thread runs: pthread_getattr_np fails without it, and a thread's number is not known here
    SCMP_SYS(sched_getaffinity),
    // time, randomness, and who and where it is
    SCMP_SYS(clock_gettime),
    SCMP_SYS(clock_getres),
    SCMP_SYS(clock_nanosleep),
    SCMP_SYS(nanosleep),
    SCMP_SYS(gettimeofday),
    SCMP_SYS(time),
    SCMP_SYS(times),
    SCMP_SYS(getrusage),
    SCMP_SYS(getrandom),
    SCMP_SYS(getpid),
    SCMP_SYS(gettid),
    SCMP_SYS(getppid),
    SCMP_SYS(getuid),
    SCMP_SYS(geteuid),
    SCMP_SYS(getgid),
    SCMP_SYS(getegid),
    SCMP_SYS(getcpu),
    SCMP_SYS(uname),
    SCMP_SYS(sysinfo),
};

// What NVIDIA's driver library asks for beside that. A GPU's driver is trusted, so this list is generous; still no name of a
// socket that others listen at (connect), no other process and no other program.
constexpr int kAllowedForTheGpu[] = {
    SCMP_SYS(mlock),
    SCMP_SYS(mlock2),
    SCMP_SYS(munlock),
    SCMP_SYS(mincore),
    SCMP_SYS(msync),
    SCMP_SYS(mbind),
    SCMP_SYS(get_mempolicy),
    SCMP_SYS(set_mempolicy),
    SCMP_SYS(memfd_create),
    SCMP_SYS(eventfd2),
    SCMP_SYS(pipe),
    SCMP_SYS(pipe2),
    SCMP_SYS(epoll_create1),
    SCMP_SYS(epoll_ctl),
    SCMP_SYS(epoll_wait),
    SCMP_SYS(epoll_pwait),
    SCMP_SYS(select),
    SCMP_SYS(pselect6),
    SCMP_SYS(flock),
    SCMP_SYS(getdents),
    SCMP_SYS(sched_getparam),
    SCMP_SYS(sched_getscheduler),
    SCMP_SYS(getpriority),
    SCMP_SYS(getrlimit),
    SCMP_SYS(getpgrp),
    SCMP_SYS(getpgid),
    SCMP_SYS(getsid),
    SCMP_SYS(getresuid),
    SCMP_SYS(getresgid),
    SCMP_SYS(getgroups),
    SCMP_SYS(capget),
    SCMP_SYS(rt_sigtimedwait),
    SCMP_SYS(rt_sigpending),
    SCMP_SYS(timerfd_create),
    SCMP_SYS(timerfd_settime),

    // a socket of its own, to wake its threads: see filtered_for_the_gpu for which
    SCMP_SYS(bind),
    SCMP_SYS(listen),
    SCMP_SYS(accept),
    SCMP_SYS(accept4),
    SCMP_SYS(getsockname),
    SCMP_SYS(getpeername),
    SCMP_SYS(setsockopt),
    SCMP_SYS(getsockopt),
    SCMP_SYS(recvfrom),
    SCMP_SYS(recvmsg),
    SCMP_SYS(sendto),
    SCMP_SYS(sendmsg),
    SCMP_SYS(shutdown),
};

// --- by their arguments ---

struct Rule {
  int call;
  std::vector<scmp_arg_cmp> arguments;  ///< all must hold
};
using Filter = std::vector<Rule>;

scmp_arg_cmp is(unsigned argument, scmp_datum_t value) { return SCMP_CMP64(argument, SCMP_CMP_EQ, value); }
scmp_arg_cmp below(unsigned argument, scmp_datum_t value) { return SCMP_CMP64(argument, SCMP_CMP_LT, value); }
/// Of the bits of the mask those of value are set, and no other.
scmp_arg_cmp bits(unsigned argument, scmp_datum_t mask, scmp_datum_t value) {
  return SCMP_CMP64(argument, SCMP_CMP_MASKED_EQ, mask, value);
}

void one_of(Filter& filter, int call, unsigned argument, std::initializer_list<scmp_datum_t> values) {
  for (const scmp_datum_t value : values) filter.push_back({call, {is(argument, value)}});
}

/// O_TRUNC beside a mode that does not write empties a file all the same, and Landlock before ABI 3 looks at the mode alone. No
/// set-user-id bits.
void openings(Filter& filter) {
  const struct {
    int call;
    unsigned flags;
  } calls[] = {{SCMP_SYS(open), 1}, {SCMP_SYS(openat), 2}};
  for (const auto& [call, flags] : calls) {
    const scmp_arg_cmp plain = bits(flags + 1, S_ISUID | S_ISGID, 0);
    filter.push_back({call, {bits(flags, O_TRUNC, 0), plain}});
    for (const unsigned mode : {O_WRONLY, O_RDWR})
      filter.push_back({call, {bits(flags, O_TRUNC | O_ACCMODE, O_TRUNC | mode), plain}});
  }
  filter.push_back({SCMP_SYS(creat), {bits(1, S_ISUID | S_ISGID, 0)}});
}

Filter filtered() {
  const auto self = static_cast<scmp_datum_t>(getpid());
  Filter filter;
  openings(filter);
  // Threads and no processes, in no other namespace.
  constexpr scmp_datum_t kThread = CLONE_VM | CLONE_FS | CLONE_FILES | CLONE_SIGHAND | CLONE_THREAD | CLONE_SYSVSEM;
  constexpr scmp_datum_t kElsewhere =
      CLONE_NEWNS | CLONE_NEWCGROUP | CLONE_NEWUTS | CLONE_NEWIPC | CLONE_NEWUSER | CLONE_NEWPID | CLONE_NEWNET;
  filter.push_back({SCMP_SYS(clone), {bits(0, kThread | kElsewhere, kThread)}});
  filter.push_back({SCMP_SYS(tgkill), {is(0, self)}});
  // Limits are asked for, never set: root could raise its own.
  for (const scmp_datum_t pid : {scmp_datum_t{0}, self}) filter.push_back({SCMP_SYS(prlimit64), {is(0, pid), is(2, 0)}});
  // Not F_SETOWN, F_SETSIG and leases, which send signals.
  one_of(filter, SCMP_SYS(fcntl), 1,
         {F_DUPFD, F_DUPFD_CLOEXEC, F_GETFD, F_SETFD, F_GETFL, F_SETFL, F_GETLK, F_SETLK, F_SETLKW, F_OFD_GETLK, F_OFD_SETLK,
          F_OFD_SETLKW});
  one_of(filter, SCMP_SYS(prctl), 0, {PR_SET_NAME, PR_GET_NAME});
  // Is this a terminal? A copy that shares its blocks. Not TIOCSTI and TIOCLINUX, which type on a terminal.
  one_of(filter, SCMP_SYS(ioctl), 1, {TCGETS, FICLONE});
  // Not MADV_HWPOISON and MADV_SOFT_OFFLINE, by which root takes memory from the machine.
  filter.push_back({SCMP_SYS(madvise), {below(2, MADV_HWPOISON)}});
  return filter;
}

/// Libraries are mapped by the loader; nothing is both written and run.
Filter code_of_libraries_alone() {
  return {{SCMP_SYS(mmap), {bits(2, PROT_EXEC, 0)}},
          {SCMP_SYS(mmap), {bits(2, PROT_WRITE, 0)}},
          {SCMP_SYS(mprotect), {bits(2, PROT_EXEC, 0)}}};
}

Filter filtered_for_the_gpu() {
  Filter filter{{SCMP_SYS(mmap), {}}, {SCMP_SYS(mprotect), {}}};
  // The driver's own commands: nvidia ('F'), modeset ('m'), WSL's dxg ('G'), dma-buf ('b'), and those of nvidia-uvm, which are
  // small numbers and two large ones. A terminal's are 0x54...
  for (const scmp_datum_t type : {'F', 'G', 'b', 'm'}) filter.push_back({SCMP_SYS(ioctl), {bits(1, 0xff00, type << 8)}});
  filter.push_back({SCMP_SYS(ioctl), {below(1, 0x5400)}});
  one_of(filter, SCMP_SYS(ioctl), 1, {0x30000001, 0x30000002, FIONREAD, FIONBIO, FIOCLEX});
  one_of(filter, SCMP_SYS(fcntl), 1, {F_ADD_SEALS, F_GET_SEALS, F_SETPIPE_SZ, F_GETPIPE_SZ});
  one_of(filter, SCMP_SYS(prctl), 0, {PR_GET_DUMPABLE, PR_GET_PDEATHSIG});
  one_of(filter, SCMP_SYS(sched_setaffinity), 0, {0, static_cast<scmp_datum_t>(getpid())});
  // Connected kinds alone: one datagram could be addressed to whoever listens.
  for (const int call : {SCMP_SYS(socket), SCMP_SYS(socketpair)}) {
    for (const scmp_datum_t type : {SOCK_STREAM, SOCK_SEQPACKET}) filter.push_back({call, {is(0, AF_UNIX), bits(1, 0xf, type)}});
  }
  return filter;
}

class FilterWriter {
 public:
  FilterWriter() : context_(seccomp_init(SCMP_ACT_ERRNO(EPERM))) {}
  ~FilterWriter() {
    if (context_ != nullptr) seccomp_release(context_);
  }
  FilterWriter(const FilterWriter&) = delete;
  FilterWriter& operator=(const FilterWriter&) = delete;

  void add(std::uint32_t action, int call, const std::vector<scmp_arg_cmp>& arguments = {}) {
    // A call that this architecture never had is not there to be allowed.
    if (context_ == nullptr || call < 0) return;
    good_ &= seccomp_rule_add_array(context_, action, call, static_cast<unsigned>(arguments.size()), arguments.data()) == 0;
  }
  void allow(const Filter& filter) {
    for (const Rule& rule : filter) add(SCMP_ACT_ALLOW, rule.call, rule.arguments);
  }
  bool load() {
    // Calls of another architecture have other numbers, and libseccomp would end the process.
    return context_ != nullptr && good_ && seccomp_attr_set(context_, SCMP_FLTATR_ACT_BADARCH, SCMP_ACT_ERRNO(EPERM)) == 0 &&
           seccomp_attr_set(context_, SCMP_FLTATR_CTL_TSYNC, 1) == 0 && seccomp_load(context_) == 0;
  }

 private:
  scmp_filter_ctx context_;
  bool good_ = true;
};

/// Calls that came with 5.1 and later, here and in kernels to come. Libraries try them and fall back on ENOSYS alone; so threads
/// are made by clone() once clone3(), whose flags a filter cannot read, is said not to exist.
constexpr int kFirstNew = 424, kLastNew = 511;

}  // namespace

bool knows_seccomp() { return prctl(PR_GET_SECCOMP, 0, 0, 0, 0) >= 0; }

bool confine_calls(Gpu gpu) {
  FilterWriter writer;
  std::vector<bool> allowed(kLastNew + 1);
  const auto allow = [&](int call) {
    writer.add(SCMP_ACT_ALLOW, call);
    if (call >= 0 && call <= kLastNew) allowed[static_cast<std::size_t>(call)] = true;
  };
  for (const int call : kAllowed) allow(call);
  if (gpu == Gpu::allowed) {
    for (const int call : kAllowedForTheGpu) allow(call);
    writer.allow(filtered_for_the_gpu());
  } else {
    writer.allow(code_of_libraries_alone());
  }
  writer.allow(filtered());
  for (int call = kFirstNew; call <= kLastNew; ++call)
    if (!allowed[static_cast<std::size_t>(call)]) writer.add(SCMP_ACT_ERRNO(ENOSYS), call);
  return writer.load();
}

}  // namespace cordillera::server::sandbox
