#include "server/sandbox/files.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "proto/parts.h"
#include "proto/paths.h"
#include "raster/disk/descriptor.h"

namespace cordillera::server::sandbox {
namespace {

namespace fs = std::filesystem;

// Debian 12's header ends at ABI 1 or 2; these are the kernel's numbers of what came later.
struct RulesetAttributes {
  std::uint64_t files = 0;
  std::uint64_t network = 0;  ///< ABI 4
  std::uint64_t scopes = 0;   ///< ABI 6
};
constexpr std::uint64_t kRefer = 1ULL << 13, kTruncate = 1ULL << 14, kIoctlDevice = 1ULL << 15;
constexpr std::uint64_t kTcp = 3;      // bind and connect: no rule allows a port
constexpr std::uint64_t kOutside = 3;  // abstract sockets of, and signals to, processes outside of the sandbox

constexpr std::uint64_t kRead = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t kWriteFile = LANDLOCK_ACCESS_FS_WRITE_FILE;
constexpr std::uint64_t kChange = kWriteFile | LANDLOCK_ACCESS_FS_REMOVE_DIR | LANDLOCK_ACCESS_FS_REMOVE_FILE |
                                  LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_REG;
constexpr std::uint64_t kLink = LANDLOCK_ACCESS_FS_MAKE_SYM;
/// Nobody gets these.
constexpr std::uint64_t kNever = LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_MAKE_CHAR | LANDLOCK_ACCESS_FS_MAKE_SOCK |
                                 LANDLOCK_ACCESS_FS_MAKE_FIFO | LANDLOCK_ACCESS_FS_MAKE_BLOCK;
/// Of a rule that names a file and no folder.
constexpr std::uint64_t kOfFiles = LANDLOCK_ACCESS_FS_READ_FILE | kWriteFile | kTruncate | kIoctlDevice;

// Libraries, PROJ's and GDAL's tables, what glibc looks up, the GPU's driver. Not: homes, other datasets, /etc as a whole, other
// processes.
constexpr const char* kReadable[] = {"/usr",           "/lib",
                                     "/lib64",         "/opt",
                                     "/dev/urandom",   "/dev/random",
                                     "/dev/zero",      "/etc/ld.so.cache",
                                     "/etc/localtime", "/etc/nsswitch.conf",
                                     "/etc/proj",      "/etc/gdal",
                                     "/proc/self",     "/proc/cpuinfo",
                                     "/proc/meminfo",  "/proc/stat",
                                     "/proc/sys/vm",   "/sys/devices/system"};
constexpr const char* kOfTheGpu[] = {"/proc/driver", "/sys", "/etc/nvidia", "/proc/modules", "/proc/devices"};

class FileRules {
 public:
  explicit FileRules(int abi) {
    if (abi < 1) return;
    RulesetAttributes attributes;
    attributes.files = kRead | kChange | kLink | kNever;
    if (abi >= 2) attributes.files |= kRefer;
    if (abi >= 3) attributes.files |= kTruncate;
    if (abi >= 4) attributes.network = kTcp;
    if (abi >= 5) attributes.files |= kIoctlDevice;
    if (abi >= 6) attributes.scopes = kOutside;
    handled_ = attributes.files;
    // An older kernel takes the longer structure as long as what it does not know is zero.
    rules_ = raster::Descriptor(static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, sizeof attributes, 0)));
  }

  /// A folder that jobs may read, and what is in it: but not what lies in `data`, the service's folder. Landlock knows no
  /// exceptions, so each thing beside it gets a rule.
  void allow_reading(const fs::path& path, const fs::path& data) {
    std::error_code error;
    const fs::path real = fs::canonical(path, error);
    if (error) return;
    if (!proto::lies_in(data, real)) return allow(real, kRead);
    if (real == data) return;
    for (fs::directory_iterator entry(real, error); !error && entry != fs::directory_iterator(); entry.increment(error)) {
      // What a link leads to has its own place: a link back up would have no end.
      std::error_code gone;
      if (!entry->is_symlink(gone)) allow_reading(entry->path(), data);
    }
  }
  /// What is not there needs no rule.
  void allow(const fs::path& path, std::uint64_t access) {
    if (!rules_.is_open() || path.empty()) return;
    const raster::Descriptor place(open(path.c_str(), O_PATH | O_CLOEXEC));
    if (!place.is_open()) return;
    std::error_code ignored;
    landlock_path_beneath_attr rule{};
    rule.allowed_access = access & handled_ & (fs::is_directory(path, ignored) ? ~std::uint64_t{0} : kOfFiles);
    rule.parent_fd = place.number();
    if (rule.allowed_access != 0) syscall(SYS_landlock_add_rule, rules_.number(), LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
  }
  bool enforce() { return rules_.is_open() && syscall(SYS_landlock_restrict_self, rules_.number(), 0) == 0; }

 private:
  raster::Descriptor rules_;
  std::uint64_t handled_ = 0;
};

/// Not /dev as a whole: terminals are there.
std::vector<fs::path> gpu_devices() {
  std::vector<fs::path> devices{"/dev/dri", "/dev/dxg"};
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator("/dev", ignored))
    if (entry.path().filename().string().starts_with("nvidia")) devices.push_back(entry.path());
  return devices;
}

}  // namespace

int landlock_abi() {
  const long abi = syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  return static_cast<int>(std::max(0L, abi));
}

bool confine_files(const Needs& needs) {
  FileRules rules(landlock_abi());
  std::error_code ignored;
  // The service may have its folder in /opt or /usr: a job's own is data/datasets/ID or data/incoming/NAME.
  const fs::path data = fs::weakly_canonical(needs.folder, ignored).parent_path().parent_path();
  for (const char* path : kReadable) rules.allow_reading(path, data);
  for (const fs::path& path : needs.readable) rules.allow_reading(path, data);
  for (const char* name : {"PROJ_DATA", "PROJ_LIB", "GDAL_DATA"}) {
    const char* list = std::getenv(name);
    proto::each_part(list == nullptr ? "" : list, ':', [&](std::string_view folder) { rules.allow_reading(folder, data); });
  }
  rules.allow("/dev/null", kRead | kWriteFile);
  rules.allow(needs.folder, kRead | kChange | kTruncate);
  // A link that the service followed would reach what the job cannot. It stays here: moving between folders (kRefer) is nobody's.
  rules.allow(needs.temporary, kLink);
  if (needs.gpu == Gpu::allowed) {
    for (const char* path : kOfTheGpu) rules.allow(path, kRead);
    rules.allow("/proc/self/task",
                kRead | kWriteFile | kTruncate);  // CUDA's driver writes its threads' names there, and gives up where it cannot
    for (const fs::path& device : gpu_devices()) rules.allow(device, kRead | kWriteFile | kIoctlDevice);
    if (const char* home = std::getenv("HOME")) rules.allow(fs::path(home) / ".nv", kRead | kChange | kTruncate);
  }
  return rules.enforce();
}

}  // namespace cordillera::server::sandbox
