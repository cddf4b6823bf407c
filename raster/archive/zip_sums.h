#pragma once
// Checksums of what a zip holds as it is. GDAL checks those of what it inflates, and reads the others as if there were none.
#include <cstdint>
#include <map>
#include <string>

namespace cordillera::raster {

/// CRC-32 by path in the zip, of members that are stored without compression, as its central directory says them (PKWARE APPNOTE
/// 4.3.12 and, beyond 4 GiB, 4.3.14). Empty where there is no directory in its place, such as behind another file's bytes.
std::map<std::string, std::uint32_t> sums_of_stored(const std::string& zip);

}  // namespace cordillera::raster
