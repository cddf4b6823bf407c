#include "server/registry.h"

#include <sqlite3.h>

#include <mutex>

#include "server/json.h"

namespace cordillera::server {
namespace {

constexpr const char* kSchema = R"(
  PRAGMA journal_mode = WAL;
  CREATE TABLE IF NOT EXISTS datasets (
    number INTEGER PRIMARY KEY, id TEXT NOT NULL UNIQUE, name TEXT NOT NULL, state TEXT NOT NULL, options TEXT NOT NULL,
    problem TEXT, created TEXT NOT NULL, raster TEXT NOT NULL, idempotency_key TEXT UNIQUE, options_hash TEXT NOT NULL,
    body_hash TEXT NOT NULL);
)";
constexpr const char* kColumns =
    "SELECT id, name, state, options, problem, created, raster, idempotency_key, options_hash, body_hash FROM datasets ";

class Statement {
 public:
  Statement(sqlite3* db, const std::string& sql) { sqlite3_prepare_v2(db, sql.c_str(), -1, &statement_, nullptr); }
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
  bool row() { return sqlite3_step(statement_) == SQLITE_ROW; }
  bool run() { return sqlite3_step(statement_) == SQLITE_DONE; }
  std::string text(int column) const {
    const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    return bytes ? std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))) : std::string();
  }

 private:
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
  return dataset;
}

class SqliteRegistry : public Registry {
 public:
  explicit SqliteRegistry(sqlite3* db) : db_(db) {}
  ~SqliteRegistry() override { sqlite3_close(db_); }

  bool add(const Dataset& dataset) override {
    const std::lock_guard lock(mutex_);
    Statement insert(db_,
                     "INSERT INTO datasets (id, name, state, options, created, raster, idempotency_key, options_hash, body_hash) "
                     "VALUES (?,?,?,?,?,?,?,?,?)");
    insert.bind(dataset.id).bind(dataset.name).bind(to_string(dataset.state)).bind(to_json_line(dataset.options));
    insert.bind(dataset.created).bind(dataset.raster).bind(none_if_empty(dataset.idempotency_key));
    return insert.bind(dataset.options_hash).bind(dataset.body_hash).run();
  }

  std::optional<Dataset> find(const std::string& id) const override { return find_where("id", id); }
  std::optional<Dataset> find_by_key(const std::string& key) const override { return find_where("idempotency_key", key); }

  std::vector<Dataset> list() const override {
    const std::lock_guard lock(mutex_);
    std::vector<Dataset> all;
    Statement select(db_, std::string(kColumns) + "ORDER BY number DESC");
    while (select.row()) all.push_back(dataset_from(select));
    return all;
  }

  void set_state(const std::string& id, State state, const std::optional<proto::Problem>& problem) override {
    const std::lock_guard lock(mutex_);
    const auto text = problem ? std::optional(to_json_line(to_error(*problem))) : std::nullopt;
    Statement(db_, "UPDATE datasets SET state = ?, problem = ? WHERE id = ?").bind(to_string(state)).bind(text).bind(id).run();
  }

  void remove(const std::string& id) override {
    const std::lock_guard lock(mutex_);
    Statement(db_, "DELETE FROM datasets WHERE id = ?").bind(id).run();
  }

 private:
  std::optional<Dataset> find_where(const std::string& column, const std::string& value) const {
    const std::lock_guard lock(mutex_);
    Statement select(db_, std::string(kColumns) + "WHERE " + column + " = ?");
    select.bind(value);
    return select.row() ? std::optional(dataset_from(select)) : std::nullopt;
  }

  mutable std::mutex mutex_;
  sqlite3* db_;
};

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
  const bool opened = sqlite3_open(path.c_str(), &db) == SQLITE_OK;
  if (!opened || sqlite3_exec(db, kSchema, nullptr, nullptr, nullptr) != SQLITE_OK) {
    const std::string why = sqlite3_errmsg(db);
    sqlite3_close(db);
    return proto::Problem{"data-unusable", "cannot use " + path + ": " + why, "a folder that can be written", "--data"};
  }
  return std::unique_ptr<Registry>(std::make_unique<SqliteRegistry>(db));
}

}  // namespace cordillera::server
