#pragma once
// A dataset as files that any web server can host, under the paths that the service itself has.
#include <string>
#include <vector>

#include "pipeline/exports/export_work.h"
#include "pipeline/faces/face.h"
#include "pipeline/store/store.h"
#include "proto/result.h"

namespace cordillera::pipeline {

/// Writes manifest.json, everything that the chosen faces name, and index.html where tileset.json is among it. The folder appears
/// whole, by a rename, or not at all; what killed processes left beside it, FOLDER.partial-PID, is removed. It may be missing,
/// empty, or an earlier export, which is replaced or refused; anything else is refused.
proto::Result<void> export_static(const faces::Terrain& terrain, const std::vector<const faces::Face*>& chosen,
                                  const std::string& folder, Existing other = Existing::replace,
                                  const exports::ExportWork& work = {});

/// Whether export_static would take the folder: to be asked before hours of work.
proto::Result<void> check_export_folder(const std::string& folder, Existing other);

}  // namespace cordillera::pipeline
