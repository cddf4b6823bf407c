#pragma once
// Folders of datasets whose rows are lost: an older registry was put back, or one without its log, or none.
#include <cstddef>
#include <optional>

#include "proto/result.h"
#include "server/data/layout.h"
#include "server/datasets/registry.h"

namespace cordillera::server {

struct Adopted {
  std::size_t adopted = 0;    ///< have a row again
  std::size_t set_aside = 0;  ///< no dataset could be made of: moved to orphans/
};

/// Why the folder's registry cannot be the one in which its datasets were: beside their folders it is missing, empty, damaged or
/// another program's. Who started on it would know of none of them.
std::optional<proto::Problem> lost_registry(const Layout& layout);

/// Gives folders without a row one, or sets them aside; nothing that could be served is removed. What was being deleted is.
Adopted adopt_folders(const Layout& layout, Registry& registry);

/// `cordillera adopt`: a new registry in the place of one that is lost, which is kept beside it. Refused while a server uses the
/// folder.
proto::Result<Adopted> make_registry(const Layout& layout);

}  // namespace cordillera::server
