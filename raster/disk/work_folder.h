#pragma once
// A folder that is written beside its place, and gets its name when all of it is there.
#include <filesystem>

namespace cordillera::raster {

/// PLACE.partial. What a killed process left there is removed first; while another process works there, it is that one's. It goes
/// with the object, unless it was moved away. Functions throw std::filesystem::filesystem_error.
class WorkFolder {
 public:
  explicit WorkFolder(const std::filesystem::path& place);
  ~WorkFolder();
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;

  /// False: another process works there, and nothing may be written.
  bool held() const { return held_; }
  const std::filesystem::path& path() const { return path_; }

 private:
  void open();
  void close();
  bool is_at_path() const;

  std::filesystem::path path_;
  int descriptor_ = -1;  ///< with the lock
  bool held_ = false;
};

}  // namespace cordillera::raster
