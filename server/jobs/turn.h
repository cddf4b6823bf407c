#pragma once
// A change whose turn it is: from the list of rasters to the version that is served.
#include "server/datasets/ledger.h"
#include "server/datasets/registry.h"

namespace cordillera::server::updates {

/// What is served was made by this change: all but the ledger is done.
bool is_done(const Layout& layout, const std::string& id, const proto::SourceChange& change);

/// Writes down what the job is to build. Problems: those of applied().
proto::Result<void> prepare(const Layout& layout, const std::string& id, const proto::SourceChange& change);

/// Puts the finished version in the place of the one that is served, which is kept beside it if `keep` is not 0. One rename: a
/// kill leaves the one or the other.
proto::Result<void> publish(const Layout& layout, const std::string& id, std::size_t keep);

/// Back to the kept version of that number, in the same way; the one that was served is gone then.
proto::Result<void> roll_back(const Layout& layout, const std::string& id, std::uint32_t number);

}  // namespace cordillera::server::updates
