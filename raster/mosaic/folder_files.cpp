#include "raster/mosaic/folder_files.h"

#include <algorithm>
#include <filesystem>
#include <set>

namespace cordillera::raster {

namespace fs = std::filesystem;

proto::Result<std::vector<std::string>> files_below(const std::string& folder) {
  std::vector<std::string> files, folders{folder};
  std::set<std::string> links, seen;  // folders by links, and the places of all so far: a link may lead to where it lies
  while (!folders.empty() || !links.empty()) {
    if (folders.empty()) folders.push_back(links.extract(links.begin()).value());
    const std::string path = std::move(folders.back());
    folders.pop_back();
    std::error_code error, none;
    const fs::path place = fs::canonical(path, none);
    if (!none && !seen.insert(place.string()).second) continue;
    for (fs::directory_iterator at(path, error), end; !error && at != end; at.increment(error)) {
      const fs::file_status status = at->status(none);
      const bool link = at->is_symlink(none);
      if (fs::is_directory(status) && link)
        links.insert(at->path().string());
      else if (fs::is_directory(status))
        folders.push_back(at->path().string());
      else if (fs::is_regular_file(status) || (link && !at->path().filename().string().starts_with('.')))
        files.push_back(at->path().string());
    }
    if (error)
      return proto::Problem{"file-unreadable", path + " cannot be read: " + error.message(), "a folder that can be read", ""};
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace cordillera::raster
