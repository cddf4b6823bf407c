#include "server/sandbox.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/sched.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#ifdef __SANITIZE_ADDRESS__  // g++
#define CORDILLERA_LEAKS_ARE_LOOKED_FOR
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)  // clang
#define CORDILLERA_LEAKS_ARE_LOOKED_FOR
#endif
#endif

#ifdef CORDILLERA_LEAKS_ARE_LOOKED_FOR
// LeakSanitizer looks at its own process as a debugger does, which a confined one may not. It asks when the process ends.
static bool g_confined = false;
extern "C" int __lsan_is_turned_off() { return g_confined ? 1 : 0; }
#endif

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

// --- files: Landlock ---

// What Debian 12's header does not name yet.
constexpr std::uint64_t kRefer = 1ULL << 13, kTruncate = 1ULL << 14;

constexpr std::uint64_t kRead = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t kWriteFile = LANDLOCK_ACCESS_FS_WRITE_FILE;
constexpr std::uint64_t kChange = kWriteFile | LANDLOCK_ACCESS_FS_REMOVE_DIR | LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_MAKE_DIR |
                                  LANDLOCK_ACCESS_FS_MAKE_REG | LANDLOCK_ACCESS_FS_MAKE_SYM;
/// Of a rule that names a file and no folder.
constexpr std::uint64_t kOfFiles = LANDLOCK_ACCESS_FS_READ_FILE | kWriteFile | kTruncate;

// Libraries, PROJ's and GDAL's tables, what glibc looks up, the GPU's driver. Not: homes, other datasets, /etc as a whole, other processes.
constexpr const char* kReadable[] = {"/usr",           "/lib",        "/lib64",       "/opt",          "/dev/urandom",       "/dev/random",    "/dev/zero",
                                     "/etc/ld.so.cache", "/etc/localtime", "/etc/nsswitch.conf", "/etc/proj", "/etc/gdal", "/proc/self", "/proc/cpuinfo",
                                     "/proc/meminfo",  "/proc/stat",  "/proc/sys/vm", "/sys/devices/system"};
constexpr const char* kOfTheGpu[] = {"/proc/driver", "/sys", "/etc/nvidia", "/proc/modules", "/proc/devices"};

class Rules {
 public:
  Rules() {
    const long abi = syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
    if (abi < 1) return;
    handled_ = kRead | kChange | LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_MAKE_CHAR | LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_FIFO |
               LANDLOCK_ACCESS_FS_MAKE_BLOCK;
    if (abi >= 2) handled_ |= kRefer;
    if (abi >= 3) handled_ |= kTruncate;
    landlock_ruleset_attr attributes{};
    attributes.handled_access_fs = handled_;
    descriptor_ = static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, sizeof attributes, 0));
  }
  ~Rules() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  Rules(const Rules&) = delete;
  Rules& operator=(const Rules&) = delete;

  /// What is not there needs no rule.
  void allow(const fs::path& path, std::uint64_t access) {
    if (descriptor_ < 0 || path.empty()) return;
    const int place = open(path.c_str(), O_PATH | O_CLOEXEC);
    if (place < 0) return;
    std::error_code ignored;
    landlock_path_beneath_attr rule{};
    rule.allowed_access = access & handled_ & (fs::is_directory(path, ignored) ? ~std::uint64_t{0} : kOfFiles);
    rule.parent_fd = place;
    if (rule.allowed_access != 0) syscall(SYS_landlock_add_rule, descriptor_, LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
    close(place);
  }
  bool enforce() { return descriptor_ >= 0 && syscall(SYS_landlock_restrict_self, descriptor_, 0) == 0; }

 private:
  int descriptor_ = -1;
  std::uint64_t handled_ = 0;
};

bool confine_files(const Sandbox& sandbox) {
  Rules rules;
  for (const char* path : kReadable) rules.allow(path, kRead);
  for (const fs::path& path : sandbox.readable) rules.allow(path, kRead);
  for (const char* name : {"PROJ_DATA", "PROJ_LIB", "GDAL_DATA"}) {
    if (const char* folder = std::getenv(name)) rules.allow(folder, kRead);
  }
  rules.allow("/dev/null", kRead | kWriteFile);
  for (const fs::path& path : sandbox.writable) rules.allow(path, kRead | kChange | kTruncate);
  rules.allow(sandbox.folder, kRead | kChange | kTruncate);
  if (sandbox.gpu == Gpu::allowed) {
    for (const char* path : kOfTheGpu) rules.allow(path, kRead);
    rules.allow("/dev", kRead | kWriteFile);
    if (const char* home = std::getenv("HOME")) rules.allow(fs::path(home) / ".nv", kRead | kChange | kTruncate);
  }
  return rules.enforce();
}

// --- system calls: seccomp ---

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#endif

constexpr std::uint32_t kRefuse = SECCOMP_RET_ERRNO | EPERM;

// Refused, not fatal: a library that asks and is told no goes on without.
constexpr std::uint32_t kRefused[] = {
    SYS_socket, SYS_connect, SYS_bind, SYS_listen, SYS_accept, SYS_accept4, SYS_sendto, SYS_sendmsg, SYS_execve, SYS_execveat, SYS_ptrace,
    SYS_process_vm_readv, SYS_process_vm_writev, SYS_mount, SYS_umount2, SYS_pivot_root, SYS_chroot, SYS_unshare, SYS_setns, SYS_bpf,
    SYS_perf_event_open, SYS_userfaultfd, SYS_keyctl, SYS_add_key, SYS_request_key, SYS_init_module, SYS_finit_module, SYS_delete_module,
    SYS_kexec_load, SYS_reboot, SYS_swapon, SYS_swapoff, SYS_io_uring_setup, SYS_open_by_handle_at, SYS_name_to_handle_at, SYS_kcmp, SYS_mknodat,
    SYS_setuid, SYS_setgid, SYS_fchmodat, SYS_fchownat,
#if defined(__x86_64__)
    SYS_fork, SYS_vfork, SYS_mknod, SYS_chown, SYS_lchown, SYS_chmod, SYS_iopl, SYS_ioperm,
#endif
};

bool confine_syscalls() {
#if defined(__x86_64__) || defined(__aarch64__)
  std::vector<sock_filter> program;
  const auto load = [&](std::size_t offset) { program.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset))); };
  const auto answer = [&](std::uint32_t value) { program.push_back(BPF_STMT(BPF_RET | BPF_K, value)); };
  const auto unless_equal_skip = [&](std::uint32_t value, std::uint8_t skip) { program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, skip)); };
  load(offsetof(seccomp_data, arch));
  unless_equal_skip(kArchitecture, 1);
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JA, 1, 0, 0));
  answer(kRefuse);  // 32-bit calls have other numbers
  load(offsetof(seccomp_data, nr));
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, 0x40000000, 0, 1));  // x32 likewise
  answer(kRefuse);
  for (const std::uint32_t call : kRefused) {
    unless_equal_skip(call, 1);
    answer(kRefuse);
  }
  // Threads are made by clone() once clone3(), whose flags a filter cannot read, is said not to exist. Processes are not made.
  unless_equal_skip(SYS_clone3, 1);
  answer(SECCOMP_RET_ERRNO | ENOSYS);
  unless_equal_skip(SYS_clone, 4);
  load(offsetof(seccomp_data, args[0]));
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, CLONE_THREAD, 1, 0));
  answer(kRefuse);
  answer(SECCOMP_RET_ALLOW);
  answer(SECCOMP_RET_ALLOW);
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter, 0, 0) == 0;
#else
  return false;
#endif
}

}  // namespace

std::vector<fs::path> cache_folders() {
  std::vector<fs::path> folders;
  const char *named = std::getenv("CORDILLERA_CACHE"), *cache = std::getenv("XDG_CACHE_HOME"), *home = std::getenv("HOME");
  if (named != nullptr) folders.emplace_back(named);
  else if (cache != nullptr) folders.push_back(fs::path(cache) / "cordillera");
  else if (home != nullptr) folders.push_back(fs::path(home) / ".cache" / "cordillera");
  return folders;
}

std::vector<fs::path> geoid_folders() {
  std::vector<fs::path> folders;
  const char* list = std::getenv("CORDILLERA_GEOIDS");
  std::string rest = list == nullptr ? "" : list;
  while (!rest.empty()) {
    const auto colon = rest.find(':');
    if (colon != 0) folders.emplace_back(rest.substr(0, colon));
    rest = colon == rest.npos ? "" : rest.substr(colon + 1);
  }
  return folders;
}

Confined confine(const Sandbox& sandbox) {
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return {};
  std::error_code ignored;
  for (const fs::path& path : sandbox.writable) fs::create_directories(path, ignored);  // a rule needs a place
  Confined confined;
  confined.files = confine_files(sandbox);
  confined.syscalls = confine_syscalls();
#ifdef CORDILLERA_LEAKS_ARE_LOOKED_FOR
  g_confined = confined.syscalls;
#endif
  return confined;
}

}  // namespace cordillera::server
