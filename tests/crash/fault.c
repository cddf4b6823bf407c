// Preloaded into the program: counts what it asks of the disk in one folder, and lets the n-th time go wrong.
//
//   FAULT_FOLDER   files below it count, others never
//   FAULT_COUNTER  a file of 16 bytes, shared by all processes: how many calls there were, and whether a job was killed, or asks
//   for the server's end FAULT_AT       which one goes wrong; 0: none FAULT_KIND     kill: half of a write, then SIGKILL, for the
//   server that this process may be a job of too
//                  job: the same for the first job that comes by from then on, and for it alone. enospc, eio: the call fails, and
//                  every later one too while the file FAULT_FULL exists
//   FAULT_FULL     see there; empty: only the n-th call fails
//   FAULT_LOG      a file that gets a line a call
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum { kNone, kKill, kJob, kNoSpace, kInput };

static struct {
  char folder[PATH_MAX];
  size_t length;
  _Atomic unsigned long* counter;
  unsigned long at;
  int kind;
  int log;
  const char* full;
} g;

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static int ours(const char* path) {
  if (!g.counter || !path) return 0;
  if (path[0] == '/') return !strncmp(path, g.folder, g.length) && (path[g.length] == '/' || path[g.length] == 0);
  return 0;
}

static int ours_fd(int fd) {
  char link[64], path[PATH_MAX];
  if (!g.counter) return 0;
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t n = readlink(link, path, sizeof path - 1);
  if (n < 0) return 0;
  path[n] = 0;
  return ours(path);
}

static int ours_at(int fd, const char* path) { return path && path[0] == '/' ? ours(path) : fd == AT_FDCWD ? 0 : ours_fd(fd); }

static int is_job(void) {
  char line[256] = "";
  const int file = REAL(open)("/proc/self/cmdline", O_RDONLY | O_CLOEXEC);
  const ssize_t n = read(file, line, sizeof line - 1);
  close(file);
  return n > 0 && !strcmp(line + strlen(line) + 1, "job");
}

// A job may signal nobody else: it asks, stands still, and ends with its server.
static void* end_with_a_job(void* nothing) {
  while (!atomic_load(g.counter + 1)) usleep(200);
  kill(getpid(), SIGKILL);
  return nothing;
}

static void end_all(void) {
  const int job = is_job();
  if (g.kind == kJob && (!job || atomic_fetch_add(g.counter + 1, 1) > 0)) return;
  if (g.kind == kKill && job)
    atomic_store(g.counter + 1, 1);
  else
    syscall(SYS_tgkill, getpid(), syscall(SYS_gettid), SIGKILL);
  while (1) pause();
}

__attribute__((constructor)) static void start(void) {
  g.log = -1;
  const char* folder = getenv("FAULT_FOLDER");
  const char* counter = getenv("FAULT_COUNTER");
  const char* kind = getenv("FAULT_KIND");
  const char* at = getenv("FAULT_AT");
  const char* log = getenv("FAULT_LOG");
  if (!folder || !counter || strlen(folder) >= sizeof g.folder) return;
  strcpy(g.folder, folder);
  const int file = REAL(open)(counter, O_RDWR | O_CLOEXEC);
  if (file < 0) return;
  void* mapped = mmap(NULL, 2 * sizeof(unsigned long), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (mapped == MAP_FAILED) return;
  g.at = at ? strtoul(at, NULL, 10) : 0;
  g.full = getenv("FAULT_FULL");
  if (kind)
    g.kind = !strcmp(kind, "kill")     ? kKill
             : !strcmp(kind, "job")    ? kJob
             : !strcmp(kind, "enospc") ? kNoSpace
             : !strcmp(kind, "eio")    ? kInput
                                       : kNone;
  if (log) g.log = REAL(open)(log, O_WRONLY | O_APPEND | O_CLOEXEC | O_CREAT, 0644);
  g.length = strlen(g.folder);
  g.counter = mapped;
  pthread_t watcher;
  if (g.kind == kKill && !is_job()) pthread_create(&watcher, NULL, end_with_a_job, NULL);
}

// What becomes of a call: 0 it goes on, else the error it fails with. half: bytes that a write may put down before the end.
static int fault(const char* call, const char* what, int takes_room, int fd, const void* bytes, size_t half) {
  const int saved = errno;
  const unsigned long n = atomic_fetch_add(g.counter, 1) + 1;
  if (g.log >= 0) {
    char line[PATH_MAX + 64];
    const int length = snprintf(line, sizeof line, "%lu %s %s\n", n, call, what ? what : "");
    if (length > 0) REAL(write)(g.log, line, (size_t)length);
  }
  errno = saved;
  if (g.at == 0 || g.kind == kNone || n < g.at) return 0;
  const int later = n > g.at;
  if (g.kind == kKill || g.kind == kJob) {
    if (later && g.kind == kKill) return 0;
    if (half > 0 && g.kind == kKill) REAL(write)(fd, bytes, half);
    end_all();
    return 0;
  }
  if (later && (!g.full || !*g.full || access(g.full, F_OK) != 0)) return 0;
  errno = saved;
  if (g.kind == kNoSpace) return takes_room ? ENOSPC : 0;
  return EIO;
}

#define FAIL_IF(mine, call, what, room, fd, bytes, half)          \
  do {                                                            \
    if (mine) {                                                   \
      const int error = fault(call, what, room, fd, bytes, half); \
      if (error) {                                                \
        errno = error;                                            \
        return -1;                                                \
      }                                                           \
    }                                                             \
  } while (0)

ssize_t write(int fd, const void* bytes, size_t count) {
  FAIL_IF(ours_fd(fd), "write", NULL, 1, fd, bytes, count / 2);
  return REAL(write)(fd, bytes, count);
}
ssize_t writev(int fd, const struct iovec* parts, int count) {
  FAIL_IF(ours_fd(fd), "writev", NULL, 1, fd, NULL, 0);
  return REAL(writev)(fd, parts, count);
}

static int torn_pwrite(int fd, const void* bytes, size_t count, off_t at) {
  if (!ours_fd(fd)) return 0;
  const unsigned long next = atomic_load(g.counter) + 1;
  if (next == g.at && g.kind == kKill) REAL(pwrite)(fd, bytes, count / 2, at);
  return fault("pwrite", NULL, 1, fd, NULL, 0);
}
ssize_t pwrite(int fd, const void* bytes, size_t count, off_t at) {
  const int error = torn_pwrite(fd, bytes, count, at);
  if (error) return errno = error, -1;
  return REAL(pwrite)(fd, bytes, count, at);
}
ssize_t pwrite64(int fd, const void* bytes, size_t count, off64_t at) {
  const int error = torn_pwrite(fd, bytes, count, at);
  if (error) return errno = error, -1;
  return REAL(pwrite64)(fd, bytes, count, at);
}

int fsync(int fd) {
  FAIL_IF(ours_fd(fd), "fsync", NULL, 1, fd, NULL, 0);
  return REAL(fsync)(fd);
}
int fdatasync(int fd) {
  FAIL_IF(ours_fd(fd), "fdatasync", NULL, 1, fd, NULL, 0);
  return REAL(fdatasync)(fd);
}
int ftruncate(int fd, off_t size) {
  FAIL_IF(ours_fd(fd), "ftruncate", NULL, 1, fd, NULL, 0);
  return REAL(ftruncate)(fd, size);
}
int ftruncate64(int fd, off64_t size) {
  FAIL_IF(ours_fd(fd), "ftruncate", NULL, 1, fd, NULL, 0);
  return REAL(ftruncate64)(fd, size);
}
int rename(const char* from, const char* to) {
  FAIL_IF(ours(from) || ours(to), "rename", to, 1, -1, NULL, 0);
  return REAL(rename)(from, to);
}
int link(const char* from, const char* to) {
  FAIL_IF(ours(to), "link", to, 1, -1, NULL, 0);
  return REAL(link)(from, to);
}
int symlink(const char* target, const char* path) {
  FAIL_IF(ours(path), "symlink", path, 1, -1, NULL, 0);
  return REAL(symlink)(target, path);
}
int mkdir(const char* path, mode_t mode) {
  FAIL_IF(ours(path), "mkdir", path, 1, -1, NULL, 0);
  return REAL(mkdir)(path, mode);
}
int unlink(const char* path) {
  FAIL_IF(ours(path), "unlink", path, 0, -1, NULL, 0);
  return REAL(unlink)(path);
}
int unlinkat(int fd, const char* path, int flags) {
  FAIL_IF(ours_at(fd, path), "unlinkat", path, 0, -1, NULL, 0);
  return REAL(unlinkat)(fd, path, flags);
}
int remove(const char* path) {
  FAIL_IF(ours(path), "remove", path, 0, -1, NULL, 0);
  return REAL(remove)(path);
}
int rmdir(const char* path) {
  FAIL_IF(ours(path), "rmdir", path, 0, -1, NULL, 0);
  return REAL(rmdir)(path);
}

// Opening counts only where it makes a file.
#define OPEN_BODY(name)                                                   \
  mode_t mode = 0;                                                        \
  if (flags & (O_CREAT | O_TMPFILE)) {                                    \
    va_list rest;                                                         \
    va_start(rest, flags);                                                \
    mode = va_arg(rest, mode_t);                                          \
    va_end(rest);                                                         \
  }                                                                       \
  FAIL_IF((flags & O_CREAT) && ours(path), "open", path, 1, -1, NULL, 0); \
  return REAL(name)(path, flags, mode)
int open(const char* path, int flags, ...) { OPEN_BODY(open); }
int open64(const char* path, int flags, ...) { OPEN_BODY(open64); }
