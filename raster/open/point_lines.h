#pragma once
// Points as text, a line each: x y z.
#include <string>

namespace cordillera::raster {

/// Whether they come as the line of sorting_line() puts them: row by row from the north, each row from west to east. Lines
/// without two numbers, such as a header, are passed over.
bool are_sorted(const std::string& path);

/// The line for a shell that puts the points of the file into the order of a grid, in another file. Names of columns stay in
/// front of them. name: what the user called it.
std::string sorting_line(const std::string& path, const std::string& name);

/// What is accepted in place of points that no raster can be read of.
inline constexpr const char* kAcceptedForPoints =
    "a raster of heights, such as a GeoTIFF; gdal_grid makes one of points with heights";

}  // namespace cordillera::raster
