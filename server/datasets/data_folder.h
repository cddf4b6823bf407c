#pragma once
// What may be done with a data folder besides serving it: clean it up, copy it while a server uses it.
#include <string>
#include <vector>

#include "proto/result.h"
#include "server/data/layout.h"

namespace cordillera::server {

/// What was set aside because no dataset could be made of it.
enum class Orphans { keep, remove };

struct Vacuumed {
  std::uint64_t files = 0;             ///< removed: folders and files that nothing names
  std::uint64_t orphans = 0;           ///< kept in orphans/
  std::uint64_t stores = 0;            ///< rewritten without free pages and unnamed blobs
  std::uintmax_t bytes = 0;            ///< less than before
  std::vector<std::string> unchanged;  ///< of stores that could not be rewritten: why, a sentence each
};
/// Removes what nothing names and gives free pages back, whatever becomes of one store; folders without a row are adopted or set
/// aside, as at a server's start. Refused while a server uses the folder.
proto::Result<Vacuumed> vacuum(const Layout& layout, Orphans orphans);

struct BackedUp {
  std::uint64_t ready = 0;           ///< datasets with their tiles
  std::uint64_t waiting = 0;         ///< with their rasters: they are built again where the backup is restored
  std::vector<std::string> damaged;  ///< those of them whose tiles are not as they were written, in the original, too
};
/// A data folder of its own, which a server can be started on: the registry as it stood at one moment, and every dataset that it
/// names. A server may use the original meanwhile; what is deleted during the copy is left out. `to` appears when all of it is on
/// disk.
proto::Result<BackedUp> backup(const Layout& layout, const std::filesystem::path& to);
/// Puts a backup where no data folder is. Every file is held against the hashes that the backup noted.
proto::Result<BackedUp> restore(const std::filesystem::path& from, const Layout& layout);

}  // namespace cordillera::server
