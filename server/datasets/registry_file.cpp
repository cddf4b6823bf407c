#include "server/datasets/registry_file.h"

#include <sqlite3.h>

#include <algorithm>
#include <cstdlib>

#include "server/http/json.h"

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
    "SELECT id, name, state, options, problem, created, raster, idempotency_key, options_hash, body_hash, owner, private, "
    "request_id, number, address "
    "FROM datasets ";
/// Columns that folders of earlier versions lack.
constexpr const char* kAddedColumns[] = {"owner TEXT NOT NULL DEFAULT ''", "private TEXT NOT NULL DEFAULT ''",
                                         "request_id TEXT NOT NULL DEFAULT ''", "address TEXT NOT NULL DEFAULT ''"};
/// The column of keys is unique, and a key is its owner's alone, so the owner stands before it. No header holds the character
/// between them.
constexpr char kAfterOwner = '\x1f';
constexpr const char* kKeysByOwner =
    "UPDATE datasets SET idempotency_key = owner || char(31) || idempotency_key WHERE owner <> '' AND instr(idempotency_key, "
    "char(31)) = 0";

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
  Statement& bind(std::int64_t value) {
    sqlite3_bind_int64(statement_, ++bound_, value);
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
  std::int64_t number(int column) const { return sqlite3_column_int64(statement_, column); }

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

std::optional<std::string> key_column(const std::string& owner, const std::string& key) {
  if (key.empty()) return std::nullopt;
  return owner.empty() ? key : owner + kAfterOwner + key;
}

Row dataset_from(const Statement& row) {
  auto dataset = std::make_shared<Dataset>();
  dataset->id = row.text(0);
  dataset->name = row.text(1);
  dataset->state = state_from(row.text(2));
  from_json(row.text(3), &dataset->options);
  proto::Error error;
  if (!row.text(4).empty() && from_json(row.text(4), &error)) dataset->problem = to_problem(error);
  dataset->created = row.text(5);
  dataset->raster = row.text(6);
  const std::string key = row.text(7);
  dataset->idempotency_key = key.substr(key.find(kAfterOwner) + 1);  // npos + 1 is 0
  dataset->options_hash = row.text(8);
  dataset->body_hash = row.text(9);
  dataset->owner = row.text(10);
  dataset->is_private = row.text(11) == "1";
  dataset->request_id = row.text(12);
  dataset->number = row.number(13);
  dataset->address = row.text(14);
  return dataset;
}

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

int number(sqlite3* db, const char* sql) {
  Statement row(db, sql);
  return row.row() ? std::atoi(row.text(0).c_str()) : 0;
}

/// Those that every version's table has; another program may call a table of its own so.
bool has_table(sqlite3* db) {
  return sqlite3_exec(db, "SELECT number, id, name, state, options, problem, created, raster FROM datasets LIMIT 0", nullptr,
                      nullptr, nullptr) == SQLITE_OK;
}

/// Beyond its first page, too. Some thousand rows take a hundredth of a second.
std::string damage_in(sqlite3* db) {
  Statement check(db, "PRAGMA quick_check(1)");
  const std::string found = check.row() ? check.text(0) : "it cannot be checked";
  return found == "ok" ? "" : "it is damaged: " + found;
}

std::optional<proto::Problem> check_kind(sqlite3* db, const std::string& path) {
  const int version = number(db, "PRAGMA user_version"), application = number(db, "PRAGMA application_id");
  if (application == 0 && number(db, "SELECT COUNT(*) FROM sqlite_master") > 0 && !has_table(db)) {
    return proto::Problem{"data-unusable", path + " is another program's database", "a data folder of its own", "--data"};
  }
  if (version <= kDataVersion && (application == 0 || application == kApplicationId)) return std::nullopt;
  return proto::Problem{"data-version",
                        path + " is of version " + std::to_string(version) +
                            " of the data folder, this program knows versions up to " + std::to_string(kDataVersion),
                        "the program that wrote it, or a later one; or a backup made before the upgrade, with cordillera restore",
                        "--data"};
}

proto::Problem unusable(const std::string& path, const std::string& why) {
  return {"data-unusable", "cannot use " + path + ": " + why, "a folder that can be written, on a disk with free space",
          "--data"};
}

/// Brings the tables to this version, all of it or nothing.
std::optional<proto::Problem> settle(sqlite3* db, const std::string& path) {
  sqlite3_busy_timeout(db, kPatience_ms);
  if (auto other = check_kind(db, path)) return other;
  const std::string marks =
      "PRAGMA application_id = " + std::to_string(kApplicationId) + "; PRAGMA user_version = " + std::to_string(kDataVersion);
  const auto execute = [db](const std::string& sql) {
    return sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
  };
  if (execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; BEGIN IMMEDIATE") && execute(kSchema) && add_columns(db) &&
      execute(kKeysByOwner) && execute(marks) && execute("COMMIT; PRAGMA wal_checkpoint(PASSIVE)")) {
    return std::nullopt;
  }
  return unusable(path, sqlite3_errmsg(db));
}

}  // namespace

proto::Result<std::unique_ptr<RegistryFile>> RegistryFile::open(const std::string& path) {
  sqlite3* db = nullptr;
  const int opened = sqlite3_open(path.c_str(), &db);
  std::unique_ptr<RegistryFile> file(new RegistryFile(db));
  try {
    if (opened != SQLITE_OK) return unusable(path, sqlite3_errmsg(db));
    if (auto problem = settle(db, path)) return *problem;
  } catch (const RegistryError& error) { return unusable(path, error.what()); }
  return file;
}

std::unique_ptr<RegistryFile> RegistryFile::read_only(const std::string& path) {
  sqlite3* db = nullptr;
  const int opened = sqlite3_open_v2(path.c_str(), &db, SQLITE_OPEN_READONLY, nullptr);
  std::unique_ptr<RegistryFile> file(new RegistryFile(db));
  if (opened != SQLITE_OK) throw RegistryError("cannot read " + path + ": " + sqlite3_errmsg(db));
  sqlite3_busy_timeout(db, kPatience_ms);
  return file;
}

std::string RegistryFile::why_not_ours(const std::string& path) {
  try {
    const auto file = read_only(path);
    if (const std::string damage = damage_in(file->db_); !damage.empty()) return damage;
    // A later version's table may be another one.
    const bool marked = number(file->db_, "PRAGMA application_id") == kApplicationId;
    return marked || has_table(file->db_) ? "" : "it has no table of datasets as a server makes it";
  } catch (const RegistryError& error) { return error.what(); }
}

RegistryFile::~RegistryFile() { sqlite3_close(db_); }

std::int64_t RegistryFile::insert(const Dataset& dataset) {
  const std::lock_guard lock(mutex_);
  Statement insert(
      db_,
      "INSERT INTO datasets (id, name, state, options, created, raster, idempotency_key, options_hash, body_hash, owner, "
      "private, request_id, address) VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?)");
  insert.bind(dataset.id).bind(dataset.name).bind(to_string(dataset.state)).bind(to_json_line(dataset.options));
  insert.bind(dataset.created).bind(dataset.raster).bind(key_column(dataset.owner, dataset.idempotency_key));
  insert.bind(dataset.options_hash).bind(dataset.body_hash).bind(dataset.owner);
  if (!insert.bind(dataset.is_private ? "1" : "").bind(dataset.request_id).bind(dataset.address).run()) return 0;
  const std::int64_t number = sqlite3_last_insert_rowid(db_);
  checkpoint();
  return number;
}

Row RegistryFile::find(const std::string& id) const { return find_where("id", id); }

Row RegistryFile::find_by_key(const std::string& owner, const std::string& key) const {
  const auto column = key_column(owner, key);
  return column ? find_where("idempotency_key", *column) : nullptr;
}

std::vector<Row> RegistryFile::below(std::int64_t number, std::size_t most) const {
  const std::lock_guard lock(mutex_);
  std::vector<Row> some;
  Statement select(db_, std::string(kColumns) + "WHERE number < ? ORDER BY number DESC LIMIT ?");
  select.bind(number).bind(static_cast<std::int64_t>(std::min<std::size_t>(most, kBeforeAll)));
  while (select.row()) some.push_back(dataset_from(select));
  return some;
}

StateCounts RegistryFile::counts() const {
  const std::lock_guard lock(mutex_);
  StateCounts counts;
  Statement select(db_, "SELECT state, COUNT(*) FROM datasets GROUP BY state");
  while (select.row()) {
    const State state = state_from(select.text(0));
    std::size_t& count = state == State::queued    ? counts.queued
                         : state == State::running ? counts.running
                         : state == State::ready   ? counts.ready
                                                   : counts.failed;
    count += std::stoul(select.text(1));
  }
  return counts;
}

void RegistryFile::set_state(const std::string& id, State state, const std::optional<proto::Problem>& problem) {
  const std::lock_guard lock(mutex_);
  const auto text = problem ? std::optional(to_json_line(to_error(*problem))) : std::nullopt;
  Statement(db_, "UPDATE datasets SET state = ?, problem = ? WHERE id = ?").bind(to_string(state)).bind(text).bind(id).run();
}

void RegistryFile::describe(const std::string& id, const proto::BuildOptions& options, bool is_private) {
  const std::lock_guard lock(mutex_);
  Statement(db_, "UPDATE datasets SET options = ?, private = ? WHERE id = ?")
      .bind(to_json_line(options))
      .bind(is_private ? "1" : "")
      .bind(id)
      .run();
}

void RegistryFile::remove(const std::string& id) {
  const std::lock_guard lock(mutex_);
  Statement(db_, "DELETE FROM datasets WHERE id = ?").bind(id).run();
  checkpoint();
}

void RegistryFile::compact() {
  const std::lock_guard lock(mutex_);
  if (sqlite3_exec(db_, "VACUUM; PRAGMA wal_checkpoint(TRUNCATE)", nullptr, nullptr, nullptr) != SQLITE_OK)
    throw RegistryError(sqlite3_errmsg(db_));
}

Row RegistryFile::find_where(const std::string& column, const std::string& value) const {
  const std::lock_guard lock(mutex_);
  Statement select(db_, std::string(kColumns) + "WHERE " + column + " = ?");
  select.bind(value);
  return select.row() ? dataset_from(select) : nullptr;
}

/// Whoever copies or restores the file without its log has the row. If it fails, or a backup reads meanwhile, the next one does
/// it: the row is on disk all the same.
void RegistryFile::checkpoint() { sqlite3_wal_checkpoint_v2(db_, nullptr, SQLITE_CHECKPOINT_PASSIVE, nullptr, nullptr); }

}  // namespace cordillera::server
