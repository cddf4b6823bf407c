#pragma once
// What the names of geoid grids say of the datum.
#include <string>
#include <string_view>

namespace cordillera::raster {

/// The datum that a grid of this name, without a folder, was published for; empty: none of ours.
std::string published_datum(std::string_view file);

/// What a grid is called, without its folder: its file's name, never that of a datum.
std::string name_of_grid(std::string_view grid);

}  // namespace cordillera::raster
