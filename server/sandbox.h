#pragma once
// What a process that opens strangers' files may still do: read the system's libraries and grids, write into its own folder, compute.
#include <filesystem>
#include <string>
#include <vector>

namespace cordillera::server {

enum class Gpu { none, allowed };  ///< its driver opens devices and keeps a cache

struct Sandbox {
  std::filesystem::path folder;                  ///< of the job: everything below may be read and written
  std::vector<std::filesystem::path> readable;   ///< folders besides the system's: geoid grids
  std::vector<std::filesystem::path> writable;   ///< caches
  Gpu gpu = Gpu::none;
};

/// What the kernel took on.
struct Confined {
  bool files = false;     ///< Landlock: Linux 5.13 with it switched on
  bool syscalls = false;  ///< seccomp: no sockets, no other programs, no looking into other processes
};

/// For this process and for good; before it starts a thread. What the kernel lacks is left out, and told.
Confined confine(const Sandbox& sandbox);

/// Folders that a build writes to besides its own: the cache of the EGM96 grid.
std::vector<std::filesystem::path> cache_folders();
/// Folders of geoid grids that the operator named.
std::vector<std::filesystem::path> geoid_folders();

}  // namespace cordillera::server
