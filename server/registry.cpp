#include "server/registry.h"

#include <sqlite3.h>

#include <cstdlib>
#include <mutex>
#include <unordered_map>

#include "pipeline/sqlite.h"
#include "server/json.h"

namespace cordillera::server {
namespace {

constexpr int kApplicationId = 0x43447267;  // "CDrg"
constexpr int kPatience_ms = 10000;         // for a backup that reads meanwhile

constexpr const char* kSchema = R"(
  CREATE TABLE IF NOT EXISTS datasets (
    number INTEGER PRIMARY KEY, id TEXT NOT NULL UNIQUE, name TEXT NOT NULL, state TEXT NOT NULL, options TEXT NOT NULL,
    problem TEXT, created TEXT NOT NULL, raster TEXT NOT NULL, idempotency_key TEXT UNIQUE, options_hash TEXT NOT NULL,
    body_hash TEXT NOT NULL);
  CREATE INDEX IF NOT EXISTS states ON datasets (state);
)";
constexpr const char* kColumns =
    "SELECT id, name, state, options, problem, created, raster, idempotency_key, options_hash, body_hash, owner, private, request_id "
    "FROM datasets ";
/// Columns that folders of earlier versions lack.
constexpr const char* kAddedColumns[] = {"owner TEXT NOT NULL DEFAULT ''", "private TEXT NOT NULL DEFAULT ''", "request_id TEXT NOT NULL DEFAULT ''"};

constexpr std::size_t kMostKnown = 4096;  // rows that are remembered

class Statement {
 public:
  Statement(sqlite3* db, const std::string& sql) : db_(db) {
    if (sqlite3_prepare_v2(db, sql.c_str(), -1, &statement_, nullptr) != SQLITE_OK) fail();
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  /// The next parameter; an empty optional is NULL.
  Statement& bind(const std::optional<std::string>& value) {
    ++bound_;
    if (value) {
      sqlite3_bind_text(statement_, bound_, value->data(), static_cast<int>(value->size()), SQLITE_TRANSIENT);
    } else {
      sqlite3_bind_null(statement_, bound_);
    }
    return *this;
  }
  /// A row that cannot be read is no missing row: datasets that seem unknown are removed.
  bool row() {
    const int step = sqlite3_step(statement_);
    if (step != SQLITE_ROW && step != SQLITE_DONE) fail();
    return step == SQLITE_ROW;
  }
  /// False: another row has what must be unique.
  bool run() {
    const int step = sqlite3_step(statement_);
    if (step != SQLITE_DONE && step != SQLITE_CONSTRAINT) fail();
    return step == SQLITE_DONE;
  }
  std::string text(int column) const {
    const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    return bytes ? std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))) : std::string();
  }

 private:
  [[noreturn]] void fail() {
    const std::string why = sqlite3_errmsg(db_);
    sqlite3_finalize(statement_);  // a constructor that throws has no destructor; a second call of it does nothing
    statement_ = nullptr;
    throw RegistryError("the registry cannot be used: " + why);
  }

  sqlite3* db_;
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
};

State state_from(const std::string& text) {
  for (const State state : {State::queued, State::running, State::ready}) {
    if (text == to_string(state)) return state;
  }
  return State::failed;
}

std::optional<std::string> none_if_empty(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

Dataset dataset_from(const Statement& row) {
  Dataset dataset;
  dataset.id = row.text(0);
  dataset.name = row.text(1);
  dataset.state = state_from(row.text(2));
  from_json(row.text(3), &dataset.options);
  proto::Error error;
  if (!row.text(4).empty() && from_json(row.text(4), &error)) dataset.problem = to_problem(error);
  dataset.created = row.text(5);
  dataset.raster = row.text(6);
  dataset.idempotency_key = row.text(7);
  dataset.options_hash = row.text(8);
  dataset.body_hash = row.text(9);
  dataset.owner = row.text(10);
  dataset.is_private = row.text(11) == "1";
  dataset.request_id = row.text(12);
  return dataset;
}

class SqliteRegistry : public Registry {
 public:
  explicit SqliteRegistry(sqlite3* db) : db_(db) {}
  ~SqliteRegistry() override { sqlite3_close(db_); }

  bool add(const Dataset& dataset) override {
    const std::lock_guard lock(mutex_);
    Statement insert(db_,
                     "INSERT INTO datasets (id, name, state, options, created, raster, idempotency_key, options_hash, body_hash, owner, "
                     "private, request_id) VALUES (?,?,?,?,?,?,?,?,?,?,?,?)");
    insert.bind(dataset.id).bind(dataset.name).bind(to_string(dataset.state)).bind(to_json_line(dataset.options));
    insert.bind(dataset.created).bind(dataset.raster).bind(none_if_empty(dataset.idempotency_key));
    insert.bind(dataset.options_hash).bind(dataset.body_hash).bind(dataset.owner);
    return insert.bind(dataset.is_private ? "1" : "").bind(dataset.request_id).run();
  }

  std::optional<Dataset> find(const std::string& id) const override {
    {
      const std::lock_guard lock(mutex_);
      if (const auto known = known_.find(id); known != known_.end()) return known->second;
    }
    return find_where("id", id);
  }
  std::optional<Dataset> find_by_key(const std::string& key) const override { return find_where("idempotency_key", key); }

  std::vector<Dataset> list() const override {
    const std::lock_guard lock(mutex_);
    std::vector<Dataset> all;
    Statement select(db_, std::string(kColumns) + "ORDER BY number DESC");
    while (select.row()) all.push_back(dataset_from(select));
    return all;
  }

  StateCounts counts() const override {
    const std::lock_guard lock(mutex_);
    StateCounts counts;
    Statement select(db_, "SELECT state, COUNT(*) FROM datasets GROUP BY state");
    while (select.row()) {
      const State state = state_from(select.text(0));
      std::size_t& count = state == State::queued ? counts.queued : state == State::running ? counts.running : state == State::ready ? counts.ready : counts.failed;
      count = std::stoul(select.text(1));
    }
    return counts;
  }

  void set_state(const std::string& id, State state, const std::optional<proto::Problem>& problem) override {
    const std::lock_guard lock(mutex_);
    known_.erase(id);
    const auto text = problem ? std::optional(to_json_line(to_error(*problem))) : std::nullopt;
    Statement(db_, "UPDATE datasets SET state = ?, problem = ? WHERE id = ?").bind(to_string(state)).bind(text).bind(id).run();
  }

  void remove(const std::string& id) override {
    const std::lock_guard lock(mutex_);
    known_.erase(id);
    Statement(db_, "DELETE FROM datasets WHERE id = ?").bind(id).run();
  }

  void compact() override {
    const std::lock_guard lock(mutex_);
    if (sqlite3_exec(db_, "VACUUM; PRAGMA wal_checkpoint(TRUNCATE)", nullptr, nullptr, nullptr) != SQLITE_OK) throw RegistryError(sqlite3_errmsg(db_));
  }

 private:
  std::optional<Dataset> find_where(const std::string& column, const std::string& value) const {
    const std::lock_guard lock(mutex_);
    Statement select(db_, std::string(kColumns) + "WHERE " + column + " = ?");
    select.bind(value);
    if (!select.row()) return std::nullopt;
    Dataset dataset = dataset_from(select);
    if (known_.size() >= kMostKnown) known_.clear();
    known_.insert_or_assign(dataset.id, dataset);
    return dataset;
  }

  mutable std::mutex mutex_;
  mutable std::unordered_map<std::string, Dataset> known_;  ///< rows as they are now: each tile that is asked for asks for its dataset
  sqlite3* db_;
};

/// What an earlier version's table lacks is added; nothing is taken away, so that one can go back.
bool add_columns(sqlite3* db) {
  for (const std::string column : kAddedColumns) {
    const std::string name = column.substr(0, column.find(' '));
    const std::string probe = "SELECT " + name + " FROM datasets LIMIT 0", alter = "ALTER TABLE datasets ADD COLUMN " + column;
    if (sqlite3_exec(db, probe.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) continue;
    if (sqlite3_exec(db, alter.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) return false;
  }
  return true;
}


int number(sqlite3* db, const char* pragma) {
  Statement row(db, pragma);
  return row.row() ? std::atoi(row.text(0).c_str()) : 0;
}

/// Brings the tables to this version, all of it or nothing.
std::optional<proto::Problem> settle(sqlite3* db, const std::string& path) {
  sqlite3_busy_timeout(db, kPatience_ms);
  const int version = number(db, "PRAGMA user_version"), application = number(db, "PRAGMA application_id");
  if (version > kDataVersion || (application != 0 && application != kApplicationId)) {
    return proto::Problem{"data-version",
                          path + " is of version " + std::to_string(version) + " of the data folder, this program knows versions up to " +
                              std::to_string(kDataVersion),
                          "the program that wrote it, or a later one; or a backup made before the upgrade, with cordillera restore", "--data"};
  }
  const std::string marks = "PRAGMA application_id = " + std::to_string(kApplicationId) + "; PRAGMA user_version = " + std::to_string(kDataVersion);
  const auto execute = [db](const std::string& sql) { return sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK; };
  if (execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; BEGIN IMMEDIATE") && execute(kSchema) && add_columns(db) && execute(marks) &&
      execute("COMMIT")) {
    return std::nullopt;
  }
  return proto::Problem{"data-unusable", "cannot use " + path + ": " + sqlite3_errmsg(db), "a folder that can be written, on a disk with free space", "--data"};
}

}  // namespace

std::string to_string(State state) {
  switch (state) {
    case State::queued: return "queued";
    case State::running: return "running";
    case State::ready: return "ready";
    case State::failed: break;
  }
  return "failed";
}

proto::Result<std::unique_ptr<Registry>> Registry::open(const std::string& path) {
  sqlite3* db = nullptr;
  std::optional<proto::Problem> problem;
  try {
    if (sqlite3_open(path.c_str(), &db) != SQLITE_OK) throw RegistryError(sqlite3_errmsg(db));
    problem = settle(db, path);
  } catch (const RegistryError& error) {
    problem = proto::Problem{"data-unusable", "cannot use " + path + ": " + error.what(), "a folder that can be written, on a disk with free space", "--data"};
  }
  if (!problem) return std::unique_ptr<Registry>(std::make_unique<SqliteRegistry>(db));
  sqlite3_close(db);
  return *problem;
}

std::unique_ptr<Registry> Registry::read_only(const std::string& path) {
  sqlite3* db = nullptr;
  if (sqlite3_open_v2(path.c_str(), &db, SQLITE_OPEN_READONLY, nullptr) == SQLITE_OK) {
    sqlite3_busy_timeout(db, kPatience_ms);
    return std::make_unique<SqliteRegistry>(db);
  }
  const std::string why = sqlite3_errmsg(db);
  sqlite3_close(db);
  throw RegistryError("cannot read " + path + ": " + why);
}

void Registry::copy(const std::string& from, const std::string& to) {
  try {
    pipeline::Database(from, pipeline::Database::Mode::shared).copy_to(to);
  } catch (const pipeline::StoreError& error) {
    throw RegistryError("cannot copy " + from + ": " + error.what());
  }
}

}  // namespace cordillera::server
