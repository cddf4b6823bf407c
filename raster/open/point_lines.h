#pragma once
// Points as text, a line each: x y z.
#include <string>

namespace cordillera::raster {

/// Whether they come as the line of sorting_line() puts them: row by row from the north, each row from west to east. Lines
/// without two numbers, such as a header, are passed over.
bool are_sorted(const std::string& path);

/// What is accepted in place of points that no raster can be read of.
inline constexpr const char* kAcceptedForPoints =
    "a raster of heights, such as a GeoTIFF; gdal_grid makes one of points with heights";

}  // namespace cordillera::raster
