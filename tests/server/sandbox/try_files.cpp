// Other datasets' files, the operator's, and those of every job.
#include <fcntl.h>
#include <linux/fs.h>
#include <pthread.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/xattr.h>
#include <unistd.h>
#include <utime.h>

#include <thread>

#include "probe.h"

namespace cordillera::probe {
namespace {

/// Opens, and closes what it got.
long opened(const std::string& path, int flags) {
  const int file = open(path.c_str(), flags, 0600);
  const int error = errno;
  if (file >= 0) close(file);
  errno = error;
  return file;
}

void try_victim(const std::string& victim, Findings& findings) {
  findings.attack("read another dataset", opened(victim, O_RDONLY));
  findings.attack("write another dataset", opened(victim, O_WRONLY));
  findings.attack("truncate(2) another dataset", truncate(victim.c_str(), 1));
  findings.attack("open another dataset to empty it", opened(victim, O_WRONLY | O_TRUNC));
  findings.attack("creat(2) over another dataset", creat(victim.c_str(), 0600));
  findings.attack("change another dataset's times by utimensat", utimensat(AT_FDCWD, victim.c_str(), nullptr, 0));
  findings.attack("change another dataset's times by utime", utime(victim.c_str(), nullptr));
  findings.attack("change another dataset's times by utimes", utimes(victim.c_str(), nullptr));
  findings.attack("change another dataset's mode by chmod", chmod(victim.c_str(), 0604));
  findings.attack("change another dataset's mode by fchmodat", fchmodat(AT_FDCWD, victim.c_str(), 0604, 0));
  findings.attack("change another dataset's mode by fchmodat2", syscall(452, AT_FDCWD, victim.c_str(), 0604, 0));
  findings.attack("change another dataset's owner", chown(victim.c_str(), getuid(), getgid()));
  findings.attack("give another dataset an attribute", setxattr(victim.c_str(), "user.mark", "x", 1, 0));
  findings.attack("give another dataset an attribute by lsetxattr", lsetxattr(victim.c_str(), "user.mark", "x", 1, 0));
  findings.attack("take another dataset's attribute", removexattr(victim.c_str(), "user.kept"));
}

/// A file that jobs may read: nothing of it changes through a descriptor that reads.
void try_readable(const std::string& grid, Findings& findings) {
  findings.attack("empty a grid by a descriptor that reads", opened(grid, O_RDONLY | O_TRUNC));
  findings.attack("empty a grid by a descriptor that does neither", opened(grid, 3 | O_TRUNC));
  findings.attack("write a grid", opened(grid, O_WRONLY));
  findings.attack("truncate(2) a grid", truncate(grid.c_str(), 1));
  const int file = open(grid.c_str(), O_RDONLY | O_CLOEXEC);
  findings.work("read a grid", file >= 0);
  findings.attack("change a grid's mode by its descriptor", fchmod(file, 0604));
  findings.attack("change a grid's times by its descriptor", futimens(file, nullptr));
  findings.attack("change a grid's owner by its descriptor", fchown(file, getuid(), getgid()));
  findings.attack("give a grid an attribute by its descriptor", fsetxattr(file, "user.mark", "x", 1, 0));
  findings.attack("lease a grid", fcntl(file, F_SETLEASE, F_RDLCK));
  close(file);
}

/// Names that the service would follow later.
void try_links(const std::string& victim, const std::filesystem::path& folder, Findings& findings) {
  const auto at = [&](const char* name) { return (folder / name).string(); };
  findings.attack("a symbolic link in the folder", symlink(victim.c_str(), at("symbolic").c_str()));
  std::filesystem::create_directories(folder / "below");
  findings.attack("a symbolic link below the folder", symlink(victim.c_str(), at("below/symbolic").c_str()));
  if (symlink(victim.c_str(), at("tmp/symbolic").c_str()) == 0) {
    findings.attack("a symbolic link moved out of the temporary folder",
                    rename(at("tmp/symbolic").c_str(), at("symbolic").c_str()));
    findings.attack("read through a symbolic link", opened(at("tmp/symbolic"), O_RDONLY));
    findings.attack("hard link to a symbolic link", link(at("tmp/symbolic").c_str(), at("hard").c_str()));
  }
  findings.attack("a hard link to another dataset", link(victim.c_str(), at("hard").c_str()));
  findings.attack("move another dataset here", rename(victim.c_str(), at("moved").c_str()));
  findings.attack("a pipe with a name", mkfifo(at("pipe").c_str(), 0600));
  findings.attack("a device", mknod(at("device").c_str(), S_IFCHR | 0600, 0));
  findings.attack("a program that runs as its owner", open(at("program").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 04755));
}

}  // namespace

void try_files(const Orders& orders, const std::filesystem::path& folder, Findings& findings) {
  const std::string victim = (orders.other / "victim").string(), parent = "/proc/" + std::to_string(getppid());
  try_victim(victim, findings);
  try_readable((orders.grids / "grid").string(), findings);
  findings.attack("write the EGM96 grid", opened(orders.egm96, O_WRONLY));
  findings.attack("empty the EGM96 grid", opened(orders.egm96, O_RDONLY | O_TRUNC));
  findings.attack("move the EGM96 grid away", rename(orders.egm96.c_str(), (folder / "egm96").c_str()));
  findings.attack("another EGM96 grid", opened((orders.egm96.parent_path() / "cordillera").string(), O_CREAT | O_WRONLY));
  findings.attack("the folder of datasets", opened(orders.other.parent_path(), O_RDONLY | O_DIRECTORY));
  findings.attack("a new file beside the datasets", opened((orders.other / "new").string(), O_CREAT | O_WRONLY));
  findings.attack("the service's environment", opened(parent + "/environ", O_RDONLY));
  findings.attack("the service's memory", opened(parent + "/mem", O_RDWR));
  findings.attack("/etc/passwd", opened("/etc/passwd", O_RDONLY));
  try_links(victim, folder, findings);
  findings.attack("delete another dataset", unlink((orders.other / "second").c_str()));
}

void try_work(const Orders& orders, const std::filesystem::path& folder, Findings& findings) {
  int sum = 0, name_file = -1;
  std::thread([&] {
    sum = 1;
    const std::string path = "/proc/self/task/" + std::to_string(syscall(SYS_gettid)) + "/comm";
    name_file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);  // as CUDA's driver does
  }).join();
  findings.work("a thread", sum == 1);
  findings.work("a thread's name, where CUDA may be used", !orders.gpu || name_file >= 0);
  int unknown = -1;
  std::thread([&] {
    pthread_attr_t attributes;
    unknown = pthread_getattr_np(pthread_self(), &attributes);
    if (unknown == 0) pthread_attr_destroy(&attributes);
  }).join();
  findings.work("what a thread has for a stack", unknown == 0);
  std::ofstream(folder / "made") << "x";
  std::error_code error;
  std::filesystem::rename(folder / "made", folder / "moved", error);
  findings.work("a file of its own, made and moved", !error && std::filesystem::remove(folder / "moved", error));
  const int from = open((folder / "source").c_str(), O_RDONLY | O_CLOEXEC);
  const int to = open((folder / "clone").c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600);
  findings.work("a copy that shares its blocks, where the disk can", ioctl(to, FICLONE, from) == 0 || errno != EPERM);
  findings.work("its folder as the current one", chdir(folder.c_str()) == 0);
  findings.work("a symbolic link among its temporary files", symlink("source", (folder / "tmp" / "link").c_str()) == 0);
  struct stat words {};
  findings.work("stderr is a pipe", fstat(2, &words) == 0 && S_ISFIFO(words.st_mode));
  std::ifstream line("/proc/self/stat");
  long pid = 0, parent = 0, group = 0, session = 0;
  std::string name, state;
  line >> pid >> name >> state >> parent >> group >> session;
  findings.work("a session of its own", session == getpid() && group == getpid());
}

}  // namespace cordillera::probe
