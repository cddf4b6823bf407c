#pragma once
// A file that SQLite reads through raster::ObjectFile, so that a database may lie in object storage.
#include <memory>
#include <string>

#include "raster/storage/object_file.h"

namespace cordillera::pipeline {

/// A file system, in SQLite's sense, that holds one file and is read-only. Connections end before it does.
class SqliteObject {
 public:
  explicit SqliteObject(std::shared_ptr<raster::ObjectFile> file);
  ~SqliteObject();
  SqliteObject(const SqliteObject&) = delete;
  SqliteObject& operator=(const SqliteObject&) = delete;

  /// For the parameter vfs of a database's address.
  const std::string& name() const;

 private:
  struct Vfs;
  std::unique_ptr<Vfs> vfs_;
};

}  // namespace cordillera::pipeline
