#pragma once
// SQLite, as much of it as stores and the registry need: a connection, statements that are prepared once, transactions that roll
// back by themselves. Failures are StoreError exceptions inside and become Problems, or exceptions of their own, at the faces.
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace cordillera::pipeline {

class SqliteObject;

/// The store's file cannot be read or written: disk full, damaged, gone.
class StoreError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// It cannot be written for want of room on its disk.
class DiskFull : public StoreError {
 public:
  using StoreError::StoreError;
};

/// The process, or the system, has no descriptor left: it passes, and the database is as it was.
class NoDescriptor : public StoreError {
 public:
  using StoreError::StoreError;
};

/// Removes the database and what SQLite keeps beside it; says nothing where one cannot be removed.
void remove_database(const std::string& path);
/// Only what SQLite keeps beside it.
void remove_logs(const std::string& path);

/// A value that is text and no blob; nothing: NULL. What it views must outlive the last step.
struct Text {
  std::optional<std::string_view> value;
};

/// For bound_steps: about a second.
inline constexpr int kStepsOfARow = 100;

/// A connection, of one thread at a time. Its SQL knows row_sum(…): eight bytes of the content hash of its arguments, their types
/// and lengths.
///
/// A file may come from anybody, and its schema may have code: views, triggers. None of them runs. No value is
/// longer than 256 MiB, but of a file that is created.
class Database {
 public:
  /// published: read-only, nobody may write the file while it is open. shared: read-only, others may write. kept: made where
  /// there is none, written, others may read and write; who holds it meanwhile is waited for. scratch: in memory, no path.
  /// foreign: as shared, of a format that may have views. They are read, with bound_steps; no value is longer than 64 MiB.
  enum class Mode { create, published, shared, kept, scratch, foreign };
  /// stop: ends a step of a foreign one that is under way, with StoreError; may be null.
  Database(const std::string& path, Mode mode, const std::atomic<bool>* stop = nullptr);
  /// A database in this one's file, published.
  explicit Database(const SqliteObject& object);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /// From here on a step of more than so many millions of instructions fails, for a reader that looks for single rows. In a sound
  /// file each takes hundreds; pages of another may lead around in circles.
  void bound_steps(int millions);
  /// What the file's schema would have computed when rows are read or written, such as "view blobs"; empty: nothing.
  std::string code_in_schema();
  void execute(const std::string& sql);
  bool knows(const std::string& sql);            ///< whether it is a statement on tables and columns that there are
  std::int64_t integer(const std::string& sql);  ///< first column of the first row; 0 when there is none
  std::int64_t last_row() const;                 ///< number of the row that was put in last
  /// Everything as it stands now, into a new file, whoever else reads or writes meanwhile.
  void copy_to(const std::string& path);
  /// Memory of the pages that it has read and keeps.
  std::size_t cache_bytes() const;
  sqlite3* handle() const { return handle_; }
  [[noreturn]] void fail() const;

 private:
  void open(const std::string& address, int flags, Mode mode);
  friend class Statement;

  sqlite3* handle_ = nullptr;
  const std::atomic<bool>* stop_ = nullptr;
  int spans_ = 0, most_spans_ = 0;  ///< a million instructions each, of the step that is under way
};

class Statement {
 public:
  Statement(Database& database, const std::string& sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  /// Starts over with new values, in the order of the question marks. Blobs must outlive the last step.
  template <class... Values>
  Statement& bind(const Values&... values) {
    rewind();
    int place = 0;
    (put(++place, values), ...);
    return *this;
  }
  bool step();  ///< true: a row is there
  void run() {
    step();
    rewind();
  }
  bool run_unless_taken();  ///< false: another row has what must be unique
  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string_view blob(int column) const;  ///< until the next step
  std::string text(int column) const { return std::string(blob(column)); }

 private:
  void rewind();
  [[noreturn]] void fail_step();
  void put(int place, std::int64_t value);
  void put(int place, std::int32_t value) { put(place, std::int64_t{value}); }
  void put(int place, std::uint32_t value) { put(place, std::int64_t{value}); }
  void put(int place, double value);
  void put(int place, std::string_view blob);
  void put(int place, Text text);
  void put(int place, const std::string& blob) { put(place, std::string_view(blob)); }

  Database& database_;
  sqlite3_stmt* handle_ = nullptr;
};

/// Rolls back unless commit() was reached.
class Transaction {
 public:
  explicit Transaction(Database& database);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  Database& database_;
  bool open_ = true;
};

}  // namespace cordillera::pipeline
