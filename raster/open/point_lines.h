#pragma once
// Points as text, a line each: x y z, or columns that the first line names.
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "proto/result.h"

namespace cordillera::raster {

/// The first line in the words by which GDAL's XYZ driver knows columns. It knows few, and of a line with others it takes the
/// first three columns for x, y and z, whatever they are. Nothing: the text is no points with names, or GDAL knows these.
/// head: the first lines, without a byte order mark. Problem "raster-format-unsupported": it is not clear which column is what.
proto::Result<std::optional<std::string>> names_for_gdal(std::string_view head, const std::string& name);

/// Calls see(x, y) for each point of a file in the order of its lines, until it says false. Whether it went to the end, and every
/// line has been a point, but for names in the first one and empty lines.
bool each_point(const std::string& path, const std::function<bool(double x, double y)>& see);

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
