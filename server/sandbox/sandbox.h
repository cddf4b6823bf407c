#pragma once
// What a process that opens strangers' files may still do: read the system's libraries and grids, write into its own folder,
// compute.
#include <filesystem>
#include <string>
#include <vector>

namespace cordillera::server::sandbox {

enum class Gpu { none, allowed };  ///< its driver opens devices, keeps a cache and asks more of the kernel

struct Needs {
  std::filesystem::path folder;                 ///< of the job: everything below may be read and written
  std::filesystem::path temporary;              ///< below it: symbolic links may be made here alone
  std::vector<std::filesystem::path> readable;  ///< files and folders besides the system's: geoid grids
  Gpu gpu = Gpu::none;
};

/// What the kernel took on.
struct Confined {
  bool files = false;     ///< Landlock: Linux 5.13 with it switched on
  bool syscalls = false;  ///< seccomp: the calls of calls.cpp, and no other
};

/// For this process and for good. What the kernel lacks is left out, and told.
Confined confine(const Needs& needs);

/// What the kernel of this machine would take on, and the same in a few words for people.
Confined offered();
std::string offered_words();

}  // namespace cordillera::server::sandbox
