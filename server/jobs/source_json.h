#pragma once
// Rasters and changes of a dataset as JSON.
#include <optional>

#include "server/http/json.h"
#include "work.pb.h"

namespace cordillera::server::updates {

/// How much of the address that a raster was fetched from.
enum class Shown { whole, without_query };

/// position: 0 wins; nullopt: it is not served yet. found: what the build found it to be, if it did.
Json source_json(const proto::DatasetSource& source, std::optional<int> position, const proto::Source* found, Shown address);
/// A change: what it is about, the version that comes or came of it, and its problem.
Json change_json(const proto::SourceChange& change, const char* state);

}  // namespace cordillera::server::updates
