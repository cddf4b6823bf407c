#pragma once
// Whose folder the data folder is, and who uses it now.
#include <filesystem>
#include <optional>
#include <string>

#include "proto/result.h"
#include "raster/disk/descriptor.h"
#include "server/data/layout.h"

namespace cordillera::server {

/// Holds the folder's lock: two servers on one folder would ruin each other's work.
class FolderLock {
 public:
  explicit FolderLock(const Layout& layout);
  bool held() const { return file_.is_open(); }
  /// Why it is not held. holder: who may hold it in our place, "a server".
  std::string why_not(const std::string& holder) const;

 private:
  raster::Descriptor file_;
  int error_;  ///< of what failed, where it is not held
};

/// Whether a server holds the lock now. Nothing is left behind.
bool is_locked(const Layout& layout);

/// What an empty disk has on it when it is mounted.
inline constexpr const char* kLostAndFound = "lost+found";

/// A folder with somebody else's files must not become a server's: what no dataset owns is removed from it. The name of one of
/// them; nothing: it is a server's, or may become one.
std::optional<std::string> others_file(const Layout& layout);

/// Why the service cannot begin with this live folder: it is none, or the data folder lies in it or it in there.
std::optional<proto::Problem> refuse_live_folder(const std::filesystem::path& folder, const std::filesystem::path& data);

}  // namespace cordillera::server
