#include "pipeline/exports/whole_file.h"

#include <unistd.h>

#include "pipeline/store/sqlite.h"

namespace cordillera::pipeline::exports {
namespace {

namespace fs = std::filesystem;

proto::Problem unwritable(const std::string& path, const std::string& why) {
  return {"output-failed", "cannot write " + path + ": " + why,
          "a file in a folder that can be written, on a disk with free space", "--output"};
}

}  // namespace

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

proto::Result<void> write_export(const std::string& path, Existing other,
                                 const std::function<void(const fs::path& sibling)>& write) {
  if (const auto usable = check_output_file(path, other); !usable) return usable;
  std::error_code error;
  // A link goes on pointing to what it points to.
  const fs::path place = fs::is_symlink(path, error) ? fs::canonical(path, error) : fs::path(path);
  const std::string name =
      std::string(".").append(place.filename().string()).append(".").append(std::to_string(getpid())).append(".partial");
  const TemporaryFile sibling(place.parent_path() / name);
  fs::remove(sibling.path(), error);
  try {
    write(sibling.path());
    fs::rename(sibling.path(), place);
    return {};
  } catch (const Refused& refused) { return refused.problem; } catch (const fs::filesystem_error& e) {
    return unwritable(path, e.code().message());
  } catch (const std::ios_base::failure&) {
    return unwritable(path, "no room, or its folder cannot be written");
  } catch (const StoreError& e) { return unwritable(path, e.what()); }
}

std::ofstream opened(const fs::path& path) {
  std::ofstream out;
  out.exceptions(std::ios::badbit | std::ios::failbit);
  out.open(path, std::ios::binary | std::ios::trunc);
  return out;
}

void append(std::ostream& out, std::string_view bytes) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); }

}  // namespace cordillera::pipeline::exports
