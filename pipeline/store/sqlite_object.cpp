#include "pipeline/store/sqlite_object.h"

#include <sqlite3.h>

#include <algorithm>
#include <atomic>
#include <cstring>

#include "pipeline/store/sqlite.h"

namespace cordillera::pipeline {
namespace {

struct OpenFile {
  sqlite3_file base;
  raster::ObjectFile* file;
};

raster::ObjectFile& file_of(sqlite3_file* opened) { return *reinterpret_cast<OpenFile*>(opened)->file; }

int read(sqlite3_file* opened, void* out, int count, sqlite3_int64 offset) {
  raster::ObjectFile& file = file_of(opened);
  const auto from = static_cast<std::uint64_t>(offset), wanted = static_cast<std::uint64_t>(count);
  const std::uint64_t there = from < file.size() ? std::min(wanted, file.size() - from) : 0;
  if (!file.read(from, there, static_cast<char*>(out)).ok()) return SQLITE_IOERR_READ;
  if (there == wanted) return SQLITE_OK;
  std::memset(static_cast<char*>(out) + there, 0, wanted - there);  // SQLite asks for it
  return SQLITE_IOERR_SHORT_READ;
}

int size(sqlite3_file* opened, sqlite3_int64* bytes) {
  *bytes = static_cast<sqlite3_int64>(file_of(opened).size());
  return SQLITE_OK;
}

// What a database that is opened as immutable is never asked for, or what there is nothing to do for.
constexpr sqlite3_io_methods kMethods{1,
                                      [](sqlite3_file*) { return SQLITE_OK; },  // close
                                      read,
                                      [](sqlite3_file*, const void*, int, sqlite3_int64) { return SQLITE_READONLY; },  // write
                                      [](sqlite3_file*, sqlite3_int64) { return SQLITE_READONLY; },                    // truncate
                                      [](sqlite3_file*, int) { return SQLITE_OK; },                                    // sync
                                      size,
                                      [](sqlite3_file*, int) { return SQLITE_OK; },                       // lock
                                      [](sqlite3_file*, int) { return SQLITE_OK; },                       // unlock
                                      [](sqlite3_file*, int* locked) { return *locked = 0, SQLITE_OK; },  // is it locked
                                      [](sqlite3_file*, int, void*) { return SQLITE_NOTFOUND; },          // control
                                      [](sqlite3_file*) { return 0; },                                    // sector: the default
                                      [](sqlite3_file*) { return SQLITE_IOCAP_IMMUTABLE; },
                                      nullptr,
                                      nullptr,
                                      nullptr,
                                      nullptr,
                                      nullptr,
                                      nullptr};

int open(sqlite3_vfs* vfs, const char* name, sqlite3_file* opened, int, int* flags) {
  opened->pMethods = nullptr;
  if (name == nullptr) return SQLITE_CANTOPEN;  // a temporary file: it is to be kept in memory
  auto* const out = reinterpret_cast<OpenFile*>(opened);
  out->file = static_cast<raster::ObjectFile*>(vfs->pAppData);
  out->base.pMethods = &kMethods;
  if (flags != nullptr) *flags = SQLITE_OPEN_READONLY;
  return SQLITE_OK;
}

int full_name(sqlite3_vfs*, const char* name, int room, char* out) {
  if (std::strlen(name) >= static_cast<std::size_t>(room)) return SQLITE_CANTOPEN;
  std::strcpy(out, name);
  return SQLITE_OK;
}

}  // namespace

struct SqliteObject::Vfs {
  explicit Vfs(std::shared_ptr<raster::ObjectFile> object) : file(std::move(object)) {
    static std::atomic<std::uint64_t> count{0};
    name = "cordillera-object-" + std::to_string(++count);
    if (sqlite3_initialize() != SQLITE_OK) throw StoreError("SQLite cannot be started");
    vfs = *sqlite3_vfs_find(nullptr);  // clocks, random numbers and the like
    vfs.iVersion = 1;
    vfs.szOsFile = sizeof(OpenFile);
    vfs.mxPathname = 64;
    vfs.pNext = nullptr;
    vfs.zName = name.c_str();
    vfs.pAppData = file.get();
    vfs.xOpen = open;
    vfs.xDelete = [](sqlite3_vfs*, const char*, int) { return SQLITE_IOERR_DELETE; };
    vfs.xAccess = [](sqlite3_vfs*, const char*, int, int* there) { return *there = 0, SQLITE_OK; };  // no log, no journal
    vfs.xFullPathname = full_name;
    if (sqlite3_vfs_register(&vfs, 0) != SQLITE_OK) throw StoreError("SQLite takes no file system");
  }
  ~Vfs() { sqlite3_vfs_unregister(&vfs); }
  Vfs(const Vfs&) = delete;
  Vfs& operator=(const Vfs&) = delete;

  std::shared_ptr<raster::ObjectFile> file;
  std::string name;
  sqlite3_vfs vfs{};
};

SqliteObject::SqliteObject(std::shared_ptr<raster::ObjectFile> file) : vfs_(std::make_unique<Vfs>(std::move(file))) {}
SqliteObject::~SqliteObject() = default;
const std::string& SqliteObject::name() const { return vfs_->name; }

}  // namespace cordillera::pipeline
