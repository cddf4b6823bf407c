#pragma once
#include <string_view>

namespace cordillera::raster {

/// Every byte, however many calls that takes. False: some are missing, and errno says why.
bool write_all(int descriptor, std::string_view bytes);

}  // namespace cordillera::raster
