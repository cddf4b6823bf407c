#pragma once
// The part of its disk that a process leaves to others, whatever it unpacks or builds.
#include <cstdint>
#include <optional>
#include <string>

#include "proto/result.h"

namespace cordillera::raster {

/// From now on so many bytes stay free on every disk that this process asks about; 0: it may fill them. It is the process's own,
/// as its limits of memory and time are: a job is told it once. Thread-safe.
void keep_free(std::uint64_t bytes);

/// "storage-full" where so many more bytes beside this path would leave less than that. what: is to be written. Nothing where
/// they have room, where all may be filled, and where the disk cannot be asked.
std::optional<proto::Problem> no_room(const std::string& path, std::uint64_t bytes, const std::string& what);

}  // namespace cordillera::raster
