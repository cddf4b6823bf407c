#pragma once
// A folder that nobody else looks into: for what GDAL is to find under a certain name, and for what ends with its command.
#include <string>

#include "raster/disk/descriptor.h"

namespace cordillera::raster {

/// Below the temporary folder ($TMPDIR). Removed, with all that is in it, when this goes.
class PrivateFolder {
 public:
  PrivateFolder();
  ~PrivateFolder();
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;

  bool made() const { return !path_.empty(); }
  const std::string& path() const { return path_; }
  /// Where a stranger's file lies in it: no folder, no letter that a driver could take for more than a name.
  std::string place(const std::string& name) const;
  /// A link to the file under that name; empty where it cannot be made.
  std::string link(const std::string& target, const std::string& name) const;

 private:
  std::string path_;
  Descriptor lock_;  ///< of the folder: a process elsewhere may have the same number, in another container of one host name
};

/// Removes those of processes of this machine that are gone, such as killed ones. For commands, at their start.
void remove_left_folders();

}  // namespace cordillera::raster
