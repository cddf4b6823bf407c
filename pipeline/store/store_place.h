#pragma once
// Where a store is made that is to take the place of a finished one: beside it, so that one of them is always there.
#include <memory>
#include <string>
#include <utility>

#include "cordillera.pb.h"
#include "proto/result.h"
#include "raster/disk/file_lock.h"

namespace cordillera::pipeline {

class StorePlace {
 public:
  /// A finished store of another plan at this path stays until settle(). All else there is StoreWriter::open's to judge. The
  /// store beside it stays over a stop, too, and a later build of its plan goes on with it. Problem: "store-write", where another
  /// process makes one there.
  static proto::Result<StorePlace> replacing(const std::string& path, const proto::Plan& plan);
  /// In the place itself.
  explicit StorePlace(std::string path) : path_(std::move(path)) {}

  const std::string& path() const { return path_; }  ///< where to make the store
  /// What was made is published and closed: it gets its name, and what an earlier build left beside it goes.
  proto::Result<void> settle();

 private:
  std::string path_, name_;  ///< name: of the store that is replaced; empty: none stands there
  std::string left_;         ///< what an earlier build may have left
  std::unique_ptr<raster::FileLock> lock_;
};

}  // namespace cordillera::pipeline
