#pragma once
// What a published store has beside its tiles: its tables, what it keeps for who builds on it, and what its manifest says of
// itself.
#include "cordillera.pb.h"
#include "pipeline/check/report.h"
#include "pipeline/store/sqlite.h"

namespace cordillera::pipeline::check {

/// The tables are those of a store of its format; none holds the work of a build that is over.
void check_tables(Database& database, const proto::Plan& plan, Findings& findings);

/// Beside a store whose rasters can be changed lies the list of changes: then the store says of which rasters it was made.
void check_version_note(Database& database, const std::string& path, Findings& findings);

/// expected: the manifest with everything made again that is summed over tiles, or the same in all stores of this version.
void check_manifest(const proto::Manifest& expected, const proto::Manifest& found, const proto::Plan& plan, Findings& findings);

}  // namespace cordillera::pipeline::check
