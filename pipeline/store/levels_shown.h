#pragma once
// Which levels show so little of the data that nobody should take them for it. Rims may move by a cell of the level, so what is
// narrower than two of its cells may be gone.
#include <optional>
#include <string>

#include "cordillera.pb.h"

namespace cordillera::pipeline {

/// The finest of the levels, from the coarsest one on, that show less than half of what the finest level does; none: there is no
/// such level, or nobody knows (stores of earlier versions, provisional tiles).
std::optional<int> last_sparse_level(const proto::Manifest& manifest);

/// What people are told of them; empty: there are none.
std::string note_on_sparse_levels(const proto::Manifest& manifest);

}  // namespace cordillera::pipeline
