#include "server/http/web_files.h"

#include <sys/stat.h>

#include <fstream>
#include <sstream>

#include "server/http/digest.h"

namespace cordillera::server {
namespace {

/// Another one in its place, or another content, has another name. Empty: there is none.
std::string name_of(const std::filesystem::path& file) {
  struct stat now {};
  if (stat(file.c_str(), &now) != 0 || !S_ISREG(now.st_mode)) return "";
  std::ostringstream name;
  name << file.string() << '\n'
       << now.st_dev << ' ' << now.st_ino << ' ' << now.st_size << ' ' << now.st_mtim.tv_sec << ' ' << now.st_mtim.tv_nsec;
  return name.str();
}

std::shared_ptr<const WebFile> read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return nullptr;
  std::string bytes(std::filesystem::file_size(file), '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  std::string etag = digest(bytes).substr(0, 32);
  return std::make_shared<const WebFile>(WebFile{std::move(bytes), std::move(etag)});
}

}  // namespace

std::shared_ptr<const WebFile> WebFiles::find(const std::filesystem::path& file) {
  const std::string name = name_of(file);
  if (name.empty()) return nullptr;
  const std::lock_guard lock(mutex_);  // while it is read, too: who asks meanwhile gets the same
  if (const auto kept = kept_.find(name)) return *kept;
  std::shared_ptr<const WebFile> found;
  if (const auto known = read_.find(name); known != read_.end()) found = known->second.lock();
  if (!found) found = read_file(file);
  if (!found) return nullptr;
  std::erase_if(read_, [](const auto& entry) { return entry.second.expired(); });
  read_.insert_or_assign(name, found);
  kept_.keep(name, found, found->bytes.size() + name.size());
  return found;
}

}  // namespace cordillera::server
