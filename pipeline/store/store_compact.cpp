#include <cerrno>
#include <cstring>
#include <filesystem>

#include "pipeline/store/sqlite.h"
#include "pipeline/store/store.h"
#include "raster/disk/write_all.h"

namespace cordillera::pipeline {
namespace {

namespace fs = std::filesystem;

bool has_waste(const std::string& path) {
  Database database(path, Database::Mode::published);
  return database.integer("PRAGMA freelist_count") > 0 ||
         database.integer(
             "SELECT EXISTS(SELECT 1 FROM blobs WHERE hash NOT IN (SELECT drc FROM tiles UNION ALL SELECT glb FROM tiles))") != 0;
}

}  // namespace

proto::Result<std::uint64_t> compact_store(const std::string& path) {
  const std::string copy = path + ".compact";
  std::error_code error;
  try {
    if (!has_waste(path)) return std::uint64_t{0};
    fs::remove(copy, error);
    Database(path, Database::Mode::published).copy_to(copy);
    {
      Database database(copy, Database::Mode::create);
      database.execute(
          "PRAGMA journal_mode = DELETE; DELETE FROM blobs WHERE hash NOT IN (SELECT drc FROM tiles UNION ALL SELECT glb FROM "
          "tiles); VACUUM");
    }
    const auto before = fs::file_size(path), after = fs::file_size(copy);
    if (!raster::sync_path(copy) || !raster::put_in_place(copy, path)) throw StoreError(std::strerror(errno));
    return before > after ? before - after : 0;
  } catch (const std::exception& e) {
    fs::remove(copy, error);
    return proto::Problem{"store-write", "the store " + path + " cannot be rewritten: " + e.what(),
                          "a sound store on a disk with room for a second one", ""};
  }
}

}  // namespace cordillera::pipeline
