#pragma once
// What the list of a zip says. GDAL checks sums of what it inflates, and reads the others as if there were none; and its own list
// of many folders takes it minutes.
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "proto/result.h"

namespace cordillera::raster {

/// CRC-32 by path in the zip, of members that are stored without compression, as its central directory says them (PKWARE APPNOTE
/// 4.3.12 and, beyond 4 GiB, 4.3.14). Empty where there is no directory in its place, such as behind another file's bytes.
std::map<std::string, std::uint32_t> sums_of_stored(const std::string& zip);

/// Whether GDAL may make its list: of few entries and folders, each file once, and no path is very long, very deep or leads out
/// of the archive. "archive-unreadable" otherwise. Nothing is said of a zip without a directory: GDAL does not open it.
proto::Result<void> check_list(const std::string& zip, const std::string& name, std::size_t most);

}  // namespace cordillera::raster
