#pragma once
// What a manifest says of a level, and which levels show so little of the data that nobody should take them for it: rims may move
// by a cell of the level, so what is narrower than two of its cells may be gone.
#include <optional>
#include <string>

#include "cordillera.pb.h"

namespace cordillera::pipeline {

/// The manifest's own; null: it has no such level.
const proto::LevelSummary* summary_of(const proto::Manifest& manifest, int level);

/// What a manifest states of a level, metres; nothing: no such level, one without tiles, or provisional tiles,
/// whose errors nobody has measured.
std::optional<double> stated_error_m(const proto::Manifest& manifest, int level);

/// The finest of the levels, from the coarsest one on, that show less than half of what the finest level does; none: there is no
/// such level, or nobody knows (stores of earlier versions, provisional tiles).
std::optional<int> last_sparse_level(const proto::Manifest& manifest);

/// What people are told of them; empty: there are none.
std::string note_on_sparse_levels(const proto::Manifest& manifest);

}  // namespace cordillera::pipeline
