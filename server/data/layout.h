#pragma once
// What lies where in the data folder.
#include <filesystem>
#include <string>

#include "proto/lattice.h"

namespace cordillera::server {

/// In a dataset's folder: what its job is told, and what the job makes.
inline constexpr const char* kJobFile = "job.json";
inline constexpr const char* kOthersWaitFile = "others-wait";  ///< is there while other builds wait for the end of this job
inline constexpr const char* kUnderWayFile = "under-way";      ///< how often the service ended while the job ran
inline constexpr const char* kStoreFile = "dataset.sqlite";
/// Provisional tiles, a store like the other: whole or not there. Beside it, while it is made, one with another name.
inline constexpr const char* kProvisionalStore = "provisional.sqlite";
inline constexpr const char* kNextProvisional = "provisional-next.sqlite";
/// Final tiles of the finest level of a block that is not done yet, a store, too.
inline constexpr const char* kFinestStore = "provisional.sqlite-finest-";
inline std::string finest_store(const proto::TileAddress& block) {
  return kFinestStore + std::to_string(block.z) + "-" + std::to_string(block.x) + "-" + std::to_string(block.y);
}
inline bool is_finest_store(const std::string& name) { return name.starts_with(kFinestStore); }
/// Behind the name of such a store while it is written.
inline constexpr const char* kBeingWritten = "-next";
/// Tiles that were asked for lately, for the job.
inline constexpr const char* kLookedAtFile = "looked-at";
/// Its date is when all of the dataset was asked for last, for the job.
inline constexpr const char* kAllWantedFile = "all-wanted";

/// The file that says which blocks of a raster are there while it is fetched by ranges. Without it nothing of the raster is.
inline std::filesystem::path map_of(const std::filesystem::path& raster) { return raster.string() + ".blocks"; }

/// In a dataset's folder: the rasters that the list at its address names.
inline constexpr const char* kRasters = "rasters";

struct Layout {
  std::filesystem::path root;

  std::filesystem::path lock() const { return root / "lock"; }
  std::filesystem::path registry() const { return root / "registry.sqlite"; }
  std::filesystem::path audit() const { return root / "audit.jsonl"; }  ///< unless told otherwise
  std::filesystem::path live() const { return root / "live.json"; }     ///< which datasets came of the live folder's files
  std::filesystem::path uploads() const { return root / "uploads"; }    ///< that arrive in parts; they stay over a restart
  std::filesystem::path incoming() const { return root / "incoming"; }  ///< uploads under way; emptied at every start
  std::filesystem::path orphans() const {
    return root / "orphans";
  }  ///< folders that no dataset could be made of; `vacuum --orphans` empties it
  std::filesystem::path removed() const { return root / "removed"; }    ///< on their way out; emptied at every start
  std::filesystem::path archives() const { return root / "archives"; }  ///< that were asked for; emptied at every start
  std::filesystem::path datasets() const { return root / "datasets"; }
  std::filesystem::path dataset(const std::string& id) const { return datasets() / id; }
  std::filesystem::path store(const std::string& id) const { return dataset(id) / kStoreFile; }
  std::filesystem::path provisional(const std::string& id) const {
    return dataset(id) / kProvisionalStore;
  }  ///< until the other is published
  std::filesystem::path finest(const std::string& id, const proto::TileAddress& block) const {
    return dataset(id) / finest_store(block);
  }
};

}  // namespace cordillera::server
