#pragma once
// GDAL's global state, held still while we talk to it.
#include <array>
#include <string>

#include "raster/source.h"

namespace cordillera::raster {

/// While it lives, in this thread: GDAL is silent and keeps its last error for us, and a posted file reaches no other file.
class GdalScope {
 public:
  explicit GdalScope(Trust trust);
  ~GdalScope();
  GdalScope(const GdalScope&) = delete;
  GdalScope& operator=(const GdalScope&) = delete;

  /// Whether GDAL reported a failure since the scope began. Some drivers do so and still say that the read succeeded.
  bool failed() const;
  /// Whether PROJ could not read its tables since this thread's outermost scope began: then what it did not find may be there all
  /// the same.
  bool tables_failed() const;
  /// GDAL's last message, not longer than a line, with the given path replaced by what the user called the file.
  std::string message(const std::string& path, const std::string& name) const;

  static constexpr std::size_t kSettingCount = 6;

 private:
  std::array<std::string, kSettingCount> before_;  ///< scopes nest: what to put back
  std::array<bool, kSettingCount> was_set_{};
};

}  // namespace cordillera::raster
