#include "raster/disk/private_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "proto/letters.h"
#include "proto/numbers.h"
#include "raster/disk/this_machine.h"

namespace cordillera::raster {

namespace fs = std::filesystem;

namespace {

/// How the names of this machine's begin; a process and six letters follow. Several machines may have one temporary folder.
std::string begin_of_names() { return "cordillera-of-" + host_name() + "-"; }

/// The process of a name that follows its begin.
std::optional<pid_t> process_of(std::string_view rest) {
  const std::size_t dash = rest.find('-');
  if (dash == rest.npos || rest.size() != dash + 1 + 6) return std::nullopt;
  const auto process = proto::number<pid_t>(rest.substr(0, dash));
  return process && *process > 0 ? process : std::nullopt;
}

/// Locked for as long as it is open; not open where another has it, or locks are not to be had.
Descriptor locked(const fs::path& folder, int how) {
  Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  return descriptor.is_open() && flock(descriptor.number(), how | LOCK_NB) == 0 ? std::move(descriptor) : Descriptor();
}

}  // namespace

void remove_left_folders() {
  std::error_code error;
  const std::string begin = begin_of_names();
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(fs::temp_directory_path(error), error)) {
    const std::string name = entry.path().filename().string();
    const auto process = name.starts_with(begin) ? process_of(std::string_view(name).substr(begin.size())) : std::nullopt;
    if (process && !is_alive(*process) && locked(entry.path(), LOCK_EX).is_open()) left.push_back(entry.path());
  }
  for (const fs::path& path : left) fs::remove_all(path, error);
}

PrivateFolder::PrivateFolder() {
  std::error_code error;
  std::string folder = (fs::temp_directory_path(error) / (begin_of_names() + std::to_string(getpid()) + "-XXXXXX")).string();
  if (error || mkdtemp(folder.data()) == nullptr) return;
  path_ = folder;
  lock_ = locked(path_, LOCK_SH);
}

PrivateFolder::~PrivateFolder() {
  std::error_code ignored;
  if (made()) fs::remove_all(path_, ignored);
}

std::string PrivateFolder::place(const std::string& name) const {
  std::string safe = name;
  for (char& c : safe)
    if (!proto::is_letter_or_digit(c, ".-_")) c = '_';
  if (safe.empty() || safe[0] == '.') safe.insert(0, "raster");
  if (safe.size() > 200) safe = safe.substr(safe.size() - 200);
  return (fs::path(path_) / safe).string();
}

std::string PrivateFolder::link(const std::string& target, const std::string& name) const {
  std::error_code error;
  const std::string path = place(name);
  if (made()) fs::create_symlink(fs::absolute(target, error), path, error);
  return made() && !error ? path : "";
}

}  // namespace cordillera::raster
