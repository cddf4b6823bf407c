#pragma once
// Files beside rasters that say something of them, such as dem.prj of dem.tif.
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace cordillera::server {

/// What of a file tells whether it is the same; of a raster, with what lies beside it.
struct FilePrint {
  std::uint64_t bytes = 0;
  std::int64_t changed_ns = 0;
  bool operator==(const FilePrint&) const = default;
  /// In any order.
  void add(const FilePrint& side);
};

/// Paths are below one folder, with slashes.
class SideFiles {
 public:
  /// A file that may be one; whose, is asked for each raster.
  void add(const std::string& path, const FilePrint& print);
  struct Side {
    std::string path;
    FilePrint print;
  };
  /// As raster::is_side_of() has it, but notes on a TIFF: programs that only look at one leave them. In the order of their names.
  std::vector<Side> of(const std::string& raster) const;

 private:
  std::map<std::string, std::vector<Side>> by_stem_;  ///< folder and name without what makes it a side, in small letters
};

}  // namespace cordillera::server
