#include "pipeline/store/sqlite.h"

#include <sqlite3.h>

#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>

#include "pipeline/store/content_hash.h"
#include "pipeline/store/sqlite_object.h"
#include "proto/letters.h"
#include "raster/disk/descriptor.h"

namespace cordillera::pipeline {
namespace {

constexpr int kPatience_ms = 10000;  // for whoever holds a file that is shared or kept
constexpr int kMostRead_bytes = 256 << 20, kMostForeign_bytes = 64 << 20;
constexpr int kSpan = 1000000;       // instructions
constexpr int kStepsOfAView = 1000;  // millions of them: it may have to sort a large archive first

// A file name as SQLite's URIs want it: %, ? and # would mean something else.
std::string uri(const std::string& path) {
  return "file:" + proto::percent_escaped(path, [](char c) { return proto::is_letter_or_digit(c, "/.-_"); });
}

template <class Number>
void append(std::string& out, Number number) {
  char bytes[sizeof number];
  std::memcpy(bytes, &number, sizeof number);
  out.append(bytes, sizeof number);
}

void append(std::string& out, sqlite3_value* value) {
  const int type = sqlite3_value_type(value);
  out += static_cast<char>(type);
  if (type == SQLITE_INTEGER) return append(out, sqlite3_value_int64(value));
  // Columns of REAL do not keep the sign of a zero.
  if (type == SQLITE_FLOAT) return append(out, sqlite3_value_double(value) + 0.0);
  const void* const bytes = sqlite3_value_blob(value);
  const auto size = static_cast<std::size_t>(sqlite3_value_bytes(value));
  append(out, std::uint64_t{size});
  if (size > 0) out.append(static_cast<const char*>(bytes), size);
}

/// SQLite calls it, whose C code no exception may pass.
void row_sum(sqlite3_context* context, int count, sqlite3_value** values) {
  try {
    std::string row;
    for (int k = 0; k < count; ++k) append(row, values[k]);
    std::int64_t sum = 0;
    std::memcpy(&sum, content_hash(row).data(), sizeof sum);
    sqlite3_result_int64(context, sum);
  } catch (const std::bad_alloc&) { sqlite3_result_error_nomem(context); } catch (const std::exception& error) {
    sqlite3_result_error(context, error.what(), -1);
  }
}

/// Want of memory is no fault of the store: as everywhere else it is std::bad_alloc.
bool wants_memory(sqlite3* handle) {
  const int code = handle == nullptr ? SQLITE_NOMEM : sqlite3_extended_errcode(handle);
  return code == SQLITE_NOMEM || code == SQLITE_IOERR_NOMEM;
}

/// A log, or the index of one, that cannot grow is an error of input and output to SQLite.
bool wants_room(sqlite3* handle) {
  const int code = sqlite3_errcode(handle), system = sqlite3_system_errno(handle);
  const bool of_system = code == SQLITE_IOERR || code == SQLITE_CANTOPEN;
  return code == SQLITE_FULL || (of_system && (system == ENOSPC || system == EDQUOT));
}

bool wants_descriptor(sqlite3* handle) {
  const int code = sqlite3_errcode(handle), system = sqlite3_system_errno(handle);
  return (code == SQLITE_IOERR || code == SQLITE_CANTOPEN) && raster::is_want_of_descriptors(system);
}

/// What went wrong, to be thrown once the handle has been put in order.
std::exception_ptr failure_of(sqlite3* handle) {
  if (wants_memory(handle)) return std::make_exception_ptr(std::bad_alloc());
  const std::string why = sqlite3_errcode(handle) == SQLITE_INTERRUPT
                              ? "a step was stopped, or takes more work than any in a sound file"
                              : sqlite3_errmsg(handle);
  if (wants_descriptor(handle)) return std::make_exception_ptr(NoDescriptor("no descriptor is left (" + why + ")"));
  return wants_room(handle) ? std::make_exception_ptr(DiskFull("the disk is full (" + why + ")"))
                            : std::make_exception_ptr(StoreError(why));
}

/// Nothing that a schema says is run. row_sum is no schema's either (SQLITE_DIRECTONLY).
bool take_code_away(sqlite3* handle, bool views) {
  for (const auto& [what, on] : {std::pair{SQLITE_DBCONFIG_DEFENSIVE, 1},
                                 {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                 {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                 {SQLITE_DBCONFIG_ENABLE_VIEW, views ? 1 : 0}}) {
    if (sqlite3_db_config(handle, what, on, nullptr) != SQLITE_OK) return false;
  }
  return true;
}

}  // namespace

void remove_database(const std::string& path) {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  remove_logs(path);
}

void remove_logs(const std::string& path) {
  std::error_code ignored;
  for (const char* suffix : {"-journal", "-wal", "-shm"}) std::filesystem::remove(path + suffix, ignored);
}

Database::Database(const std::string& path, Mode mode, const std::atomic<bool>* stop) : stop_(stop) {
  const bool writes = mode == Mode::create || mode == Mode::kept || mode == Mode::scratch;
  const int flags =
      SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_URI | (writes ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY);
  const std::string name = mode == Mode::scratch ? ":memory:" : uri(path) + (mode == Mode::published ? "?immutable=1" : "");
  open(name, flags, mode);
  if (mode == Mode::shared || mode == Mode::kept || mode == Mode::foreign) sqlite3_busy_timeout(handle_, kPatience_ms);
  if (mode == Mode::foreign) bound_steps(kStepsOfAView);
}

Database::Database(const SqliteObject& object) {
  open("file:/object?immutable=1&vfs=" + object.name(), SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_URI | SQLITE_OPEN_READONLY,
       Mode::published);
  try {
    execute("PRAGMA temp_store = MEMORY");
  } catch (...) {
    sqlite3_close(handle_);
    throw;
  }
}

void Database::open(const std::string& address, int flags, Mode mode) {
  constexpr int kOfFunction = SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_DIRECTONLY;
  if (sqlite3_open_v2(address.c_str(), &handle_, flags, nullptr) == SQLITE_OK && take_code_away(handle_, mode == Mode::foreign) &&
      sqlite3_create_function(handle_, "row_sum", -1, kOfFunction, nullptr, row_sum, nullptr, nullptr) == SQLITE_OK) {
    if (mode != Mode::create && mode != Mode::scratch)
      sqlite3_limit(handle_, SQLITE_LIMIT_LENGTH, mode == Mode::foreign ? kMostForeign_bytes : kMostRead_bytes);
    return;
  }
  const std::exception_ptr failure = failure_of(handle_);
  sqlite3_close(handle_);
  std::rethrow_exception(failure);
}

void Database::bound_steps(int millions) {
  most_spans_ = millions;
  const auto ends = [](void* database) {
    auto& self = *static_cast<Database*>(database);
    return ++self.spans_ >= self.most_spans_ || (self.stop_ != nullptr && *self.stop_) ? 1 : 0;
  };
  sqlite3_progress_handler(handle_, kSpan, ends, this);
}

std::string Database::code_in_schema() {
  // A virtual table has no page. What stands in the list is what SQLite has read: it compares both.
  Statement schema(
      *this,
      "SELECT CASE WHEN type = 'table' THEN 'virtual table' ELSE type END, name FROM sqlite_schema WHERE type NOT IN "
      "('table', 'index') OR (type = 'table' AND rootpage = 0) LIMIT 1");
  if (schema.step()) return schema.text(0) + " " + schema.text(1);
  Statement columns(*this,
                    "SELECT s.name, c.name FROM sqlite_schema s, pragma_table_xinfo(s.name) c WHERE s.type = 'table' AND "
                    "c.hidden <> 0 LIMIT 1");
  return columns.step() ? "computed column " + columns.text(1) + " of " + columns.text(0) : "";
}

Database::~Database() { sqlite3_close(handle_); }

void Database::fail() const { std::rethrow_exception(failure_of(handle_)); }

void Database::execute(const std::string& sql) {
  spans_ = 0;
  if (sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail();
}

bool Database::knows(const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v2(handle_, sql.c_str(), -1, &statement, nullptr);
  sqlite3_finalize(statement);
  if (code != SQLITE_OK && code != SQLITE_ERROR) fail();  // of a damaged file nobody knows what it holds
  return code == SQLITE_OK;
}

std::int64_t Database::last_row() const { return sqlite3_last_insert_rowid(handle_); }

std::int64_t Database::integer(const std::string& sql) {
  Statement statement(*this, sql);
  return statement.step() ? statement.integer(0) : 0;
}

void Database::copy_to(const std::string& path) {
  const Database to(path, Mode::create);
  sqlite3_backup* backup = sqlite3_backup_init(to.handle_, "main", handle_, "main");
  if (backup == nullptr) to.fail();
  const int stepped = sqlite3_backup_step(backup, -1);
  if (sqlite3_backup_finish(backup) != SQLITE_OK || stepped != SQLITE_DONE) to.fail();
}

std::size_t Database::cache_bytes() const {
  int now = 0, most = 0;
  return sqlite3_db_status(handle_, SQLITE_DBSTATUS_CACHE_USED, &now, &most, 0) == SQLITE_OK ? static_cast<std::size_t>(now) : 0;
}

Statement::Statement(Database& database, const std::string& sql) : database_(database) {
  if (sqlite3_prepare_v2(database.handle(), sql.c_str(), -1, &handle_, nullptr) != SQLITE_OK) database.fail();
}

Statement::~Statement() { sqlite3_finalize(handle_); }

bool Statement::step() {
  database_.spans_ = 0;
  switch (sqlite3_step(handle_)) {
    case SQLITE_ROW: return true;
    case SQLITE_DONE: return false;
    default: fail_step();
  }
}

bool Statement::run_unless_taken() {
  const int code = sqlite3_step(handle_);
  if (code != SQLITE_DONE && code != SQLITE_CONSTRAINT) fail_step();
  rewind();
  return code == SQLITE_DONE;
}

void Statement::fail_step() {
  const std::exception_ptr failure = failure_of(database_.handle());
  rewind();
  std::rethrow_exception(failure);
}

void Statement::rewind() { sqlite3_reset(handle_); }

void Statement::put(int place, std::int64_t value) {
  if (sqlite3_bind_int64(handle_, place, value) != SQLITE_OK) database_.fail();
}
void Statement::put(int place, double value) {
  if (sqlite3_bind_double(handle_, place, value) != SQLITE_OK) database_.fail();
}
void Statement::put(int place, std::string_view blob) {
  const char* data = blob.empty() ? "" : blob.data();  // a null pointer would bind NULL
  if (sqlite3_bind_blob64(handle_, place, data, blob.size(), SQLITE_STATIC) != SQLITE_OK) database_.fail();
}

void Statement::put(int place, Text text) {
  const int code = text.value ? sqlite3_bind_text64(handle_, place, text.value->empty() ? "" : text.value->data(),
                                                    text.value->size(), SQLITE_STATIC, SQLITE_UTF8)
                              : sqlite3_bind_null(handle_, place);
  if (code != SQLITE_OK) database_.fail();
}

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(handle_, column); }
double Statement::real(int column) const { return sqlite3_column_double(handle_, column); }
std::string_view Statement::blob(int column) const {
  const void* data = sqlite3_column_blob(handle_, column);
  return data ? std::string_view(static_cast<const char*>(data), static_cast<std::size_t>(sqlite3_column_bytes(handle_, column)))
              : std::string_view();
}

Transaction::Transaction(Database& database) : database_(database) { database_.execute("BEGIN IMMEDIATE"); }

Transaction::~Transaction() {
  if (open_) sqlite3_exec(database_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() {
  database_.execute("COMMIT");
  open_ = false;
}

}  // namespace cordillera::pipeline
