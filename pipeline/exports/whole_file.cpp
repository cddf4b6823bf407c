#include "pipeline/exports/whole_file.h"

#include <unistd.h>

#include <optional>
#include <vector>

#include "pipeline/store/sqlite.h"
#include "proto/numbers.h"
#include "proto/paths.h"
#include "raster/disk/descriptor.h"
#include "raster/disk/this_machine.h"

namespace cordillera::pipeline::exports {
namespace {

namespace fs = std::filesystem;

/// It passes, and is no fault of the place nor of what is read.
proto::Problem wants_descriptor() {
  return {"service-busy", "no descriptor is left to write a file", "trying again later, or a larger limit of open files", ""};
}

/// errno is asked at once: what goes as an exception passes may change it.
template <class Stream>
Stream opened_stream(const fs::path& path, std::ios::openmode mode) {
  Stream stream;
  errno = 0;
  stream.open(path, mode);
  if (!stream && raster::is_want_of_descriptors(errno)) throw NoDescriptor("no descriptor is left");
  stream.exceptions(std::ios::badbit | std::ios::failbit);  // throws where it could not be opened
  return stream;
}

/// The process of a name; none where the name is another one.
std::optional<pid_t> process_of(std::string_view name, std::string_view before, std::string_view end) {
  if (!name.starts_with(before) || !name.ends_with(end) || name.size() <= before.size() + end.size()) return std::nullopt;
  const auto digits = name.substr(before.size(), name.size() - before.size() - end.size());
  const auto process = proto::number<pid_t>(digits);
  return process && *process > 0 && std::to_string(*process) == digits ? process : std::nullopt;
}

}  // namespace

proto::Problem unwritable(const std::string& path, const std::string& why) {
  return {"output-failed", "cannot write " + path + ": " + why,
          "a file in a folder that can be written, on a disk with free space", "--output"};
}

proto::Problem damaged(const std::string& what, const std::exception& damage) {
  return {"store-damaged", what + " is damaged: " + damage.what(),
          "a backup, or the raster built again; cordillera check says what is damaged", "path"};
}

faces::Document made(const faces::Terrain& terrain, const faces::Resource& resource, const faces::Place& place) {
  if (terrain.is_stopped()) throw Refused{kStopped};
  auto document = resource.make(terrain, place);
  if (!document.ok()) throw Refused{document.problem()};
  if (!*document) throw StoreError("the bytes of " + faces::path_of(resource, place) + " are missing");
  return std::move(**document);
}

proto::Result<void> check_output_file(const std::string& path, Existing other) {
  std::error_code error;
  if (!fs::exists(path, error)) {
    const fs::path folder = fs::path(path).parent_path();
    if (folder.empty() || fs::is_directory(folder, error)) return {};
    return unwritable(path, "there is no folder " + folder.string());
  }
  if (!fs::is_regular_file(path, error)) return unwritable(path, "it is there and no file");
  if (other == Existing::refuse) {
    return proto::Problem{"output-exists", path + " exists", "another name, or --overwrite to replace it", "--output"};
  }
  return {};
}

void remove_left_behind(const fs::path& folder, const std::string& before, std::initializer_list<const char*> ends) {
  std::error_code error;
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
    for (const char* const end : ends) {
      const auto process = process_of(entry.path().filename().string(), before, end);
      if (process && !raster::is_alive(*process) && !entry.is_symlink(error)) left.push_back(entry.path());
    }
  }
  for (const fs::path& path : left) fs::remove_all(path, error);
}

proto::Result<void> write_export(const std::string& path, Existing other,
                                 const std::function<void(const fs::path& sibling)>& write) {
  if (const auto usable = check_output_file(path, other); !usable) return usable;
  std::error_code error;
  const fs::path place = proto::behind_link(path, error);
  std::string before = ".";
  before.append(place.filename().string()).append(".");
  remove_left_behind(place.parent_path(), before, {".partial", ".partial.tiles", ".partial-journal"});
  const TemporaryFile sibling(place.parent_path() / (before + std::to_string(getpid()) + ".partial"));
  fs::remove(sibling.path(), error);
  try {
    write(sibling.path());
    fs::rename(sibling.path(), place);
    return {};
  } catch (const Refused& refused) { return refused.problem; } catch (const fs::filesystem_error& e) {
    return raster::is_want_of_descriptors(e.code().value()) ? wants_descriptor() : unwritable(path, e.code().message());
  } catch (const std::ios_base::failure&) {
    return unwritable(path, "no room, or its folder cannot be written");
  } catch (const NoDescriptor&) {
    return wants_descriptor();
  } catch (const StoreError& e) {  // of what is read: a writer of another database says Refused
    return damaged("what is exported", e);
  }
}

std::ofstream opened(const fs::path& path) {
  return opened_stream<std::ofstream>(path, std::ios::out | std::ios::binary | std::ios::trunc);
}

std::ifstream opened_to_read(const fs::path& path) { return opened_stream<std::ifstream>(path, std::ios::in | std::ios::binary); }

void append(std::ostream& out, std::string_view bytes) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); }

}  // namespace cordillera::pipeline::exports
