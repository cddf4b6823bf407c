#pragma once
// How long a NetCDF file of the old kind has to be: its library reads zeros beyond the end, and says nothing.
#include <cstdint>
#include <optional>
#include <string>

namespace cordillera::raster {

/// Bytes up to the last value of its variables, by its header; nothing where the file is of another kind (NetCDF-4 is HDF5, which
/// knows its length itself) or its header is none.
std::optional<std::uint64_t> netcdf_length(const std::string& path);

}  // namespace cordillera::raster
