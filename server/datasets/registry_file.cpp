#include "server/datasets/registry_file.h"

#include <unistd.h>

#include <filesystem>
#include <new>

#include "server/http/json.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

constexpr int kApplicationId = 0x43447267;  // "CDrg"

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

using pipeline::Database;
using pipeline::Statement;
using pipeline::StoreError;
using pipeline::Text;

/// A row that cannot be read is no missing row: datasets that seem unknown are removed.
template <class Work>
auto used(const Work& work) try {
  return work();
} catch (const StoreError& error) {
  throw RegistryError(std::string("the registry cannot be used: ") + error.what());
} catch (const std::bad_alloc&) { throw RegistryError("the registry cannot be used: out of memory"); }

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
  dataset->number = row.integer(13);
  dataset->address = row.text(14);
  return dataset;
}

/// What an earlier version's table lacks is added; nothing is taken away, so that one can go back.
void add_columns(Database& database) {
  for (const std::string column : kAddedColumns) {
    if (!database.knows("SELECT " + column.substr(0, column.find(' ')) + " FROM datasets LIMIT 0"))
      database.execute("ALTER TABLE datasets ADD COLUMN " + column);
  }
}

/// Those that every version's table has; another program may call a table of its own so.
bool has_table(Database& database) {
  return database.knows("SELECT number, id, name, state, options, problem, created, raster FROM datasets LIMIT 0");
}

/// Beyond its first page, too. Some thousand rows take a hundredth of a second.
std::string damage_in(Database& database) {
  Statement check(database, "PRAGMA quick_check(1)");
  const std::string found = check.step() ? check.text(0) : "it cannot be checked";
  return found == "ok" ? "" : "it is damaged: " + found;
}

std::optional<proto::Problem> check_kind(Database& database, const std::string& path) {
  const std::int64_t version = database.integer("PRAGMA user_version"), application = database.integer("PRAGMA application_id");
  if (application == 0 && database.integer("SELECT COUNT(*) FROM sqlite_master") > 0 && !has_table(database)) {
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

proto::Problem without_room(const std::string& path, const std::string& why) {
  return {"data-unusable", "cannot use " + path + ": " + why,
          "a few MiB free on its disk: make room there and start again; the datasets are as they were", "--data"};
}

/// Brings the tables to this version, all of it or nothing.
std::optional<proto::Problem> settle(Database& database, const std::string& path) {
  if (auto other = check_kind(database, path)) return other;
  database.execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; BEGIN IMMEDIATE");
  database.execute(kSchema);
  add_columns(database);
  database.execute(kKeysByOwner);
  database.execute("PRAGMA application_id = " + std::to_string(kApplicationId) +
                   "; PRAGMA user_version = " + std::to_string(kDataVersion));
  database.execute("COMMIT; PRAGMA wal_checkpoint(PASSIVE)");
  return std::nullopt;
}

}  // namespace

proto::Result<std::unique_ptr<RegistryFile>> RegistryFile::open(const std::string& path) try {
  std::unique_ptr<RegistryFile> file(new RegistryFile(path, Database::Mode::kept));
  if (auto problem = settle(file->database_, path)) return *problem;
  return file;
} catch (const pipeline::DiskFull& full) { return without_room(path, full.what()); } catch (const StoreError& error) {
  return unusable(path, error.what());
}

/// SQLite wants to put files beside one that has a log. Where nobody may, as in a snapshot, the file alone says all, unless a log
/// is left.
Database::Mode RegistryFile::to_read(const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(path).parent_path();
  std::error_code error;
  if (::access(folder.empty() ? "." : folder.c_str(), W_OK) == 0 || fs::exists(path + "-shm", error))
    return Database::Mode::shared;
  const auto log = fs::file_size(path + "-wal", error);
  return error || log == 0 ? Database::Mode::published : Database::Mode::shared;
}

std::optional<proto::Problem> RegistryFile::refused(const std::string& path) try {
  Database database(path, to_read(path));
  if (auto other = check_kind(database, path)) return other;
  const std::string damage = damage_in(database);
  return damage.empty() ? std::nullopt : std::optional(unusable(path, damage));
} catch (const StoreError& error) { return unusable(path, error.what()); }

std::unique_ptr<RegistryFile> RegistryFile::read_only(const std::string& path) try {
  return std::unique_ptr<RegistryFile>(new RegistryFile(path, to_read(path)));
} catch (const StoreError& error) { throw RegistryError("cannot read " + path + ": " + error.what()); }

std::string RegistryFile::why_not_ours(const std::string& path) try {
  Database database(path, to_read(path));
  if (const std::string damage = damage_in(database); !damage.empty()) return damage;
  // A later version's table may be another one.
  const bool marked = database.integer("PRAGMA application_id") == kApplicationId;
  return marked || has_table(database) ? "" : "it has no table of datasets as a server makes it";
} catch (const pipeline::DiskFull&) {
  return "";  // nothing is known of it: who opens it to write is told
} catch (const StoreError& error) { return error.what(); }

std::int64_t RegistryFile::insert(const Dataset& dataset) {
  const std::lock_guard lock(mutex_);
  return used([&]() -> std::int64_t {
    const std::string state = to_string(dataset.state), options = to_json_line(dataset.options);
    const auto key = key_column(dataset.owner, dataset.idempotency_key);
    Statement insert(
        database_,
        "INSERT INTO datasets (id, name, state, options, created, raster, idempotency_key, options_hash, body_hash, owner, "
        "private, request_id, address) VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?)");
    insert.bind(Text{dataset.id}, Text{dataset.name}, Text{state}, Text{options}, Text{dataset.created}, Text{dataset.raster},
                Text{key}, Text{dataset.options_hash}, Text{dataset.body_hash}, Text{dataset.owner},
                Text{dataset.is_private ? "1" : ""}, Text{dataset.request_id}, Text{dataset.address});
    if (!insert.run_unless_taken()) return 0;
    const std::int64_t number = database_.last_row();
    checkpoint();
    return number;
  });
}

Row RegistryFile::find(const std::string& id) const { return find_where("id", id); }

bool RegistryFile::holds(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  return used([&] { return Statement(database_, "SELECT 1 FROM datasets WHERE id = ?").bind(Text{id}).step(); });
}

Row RegistryFile::find_by_key(const std::string& owner, const std::string& key) const {
  const auto column = key_column(owner, key);
  return column ? find_where("idempotency_key", *column) : nullptr;
}

std::vector<Row> RegistryFile::below(std::int64_t number, std::size_t most) const {
  const std::lock_guard lock(mutex_);
  return used([&] {
    std::vector<Row> some;
    Statement select(database_, std::string(kColumns) + "WHERE number < ? ORDER BY number DESC");
    select.bind(number);
    while (some.size() < most && select.step()) {
      Row row = dataset_from(select);
      if (stays_in_its_folder(*row))
        some.push_back(std::move(row));
      else
        log_warning("dataset '" + row->id + "' with the raster '" + row->raster +
                    "' is left out of what the registry has: that is no id, or the raster lies outside its folder");
    }
    return some;
  });
}

StateCounts RegistryFile::counts() const {
  const std::lock_guard lock(mutex_);
  return used([&] {
    StateCounts counts;
    Statement select(database_, "SELECT state, COUNT(*) FROM datasets GROUP BY state");
    while (select.step()) {
      const State state = state_from(select.text(0));
      std::size_t& count = state == State::queued    ? counts.queued
                           : state == State::running ? counts.running
                           : state == State::ready   ? counts.ready
                                                     : counts.failed;
      count += static_cast<std::size_t>(select.integer(1));
    }
    return counts;
  });
}

void RegistryFile::set_state(const std::string& id, State state, const std::optional<proto::Problem>& problem) {
  const std::lock_guard lock(mutex_);
  used([&] {
    const std::string now = to_string(state);
    const auto text = problem ? std::optional(to_json_line(to_error(*problem))) : std::nullopt;
    Statement(database_, "UPDATE datasets SET state = ?, problem = ? WHERE id = ?").bind(Text{now}, Text{text}, Text{id}).run();
  });
}

void RegistryFile::describe(const std::string& id, const proto::BuildOptions& options, bool is_private) {
  const std::lock_guard lock(mutex_);
  used([&] {
    const std::string text = to_json_line(options);
    Statement(database_, "UPDATE datasets SET options = ?, private = ? WHERE id = ?")
        .bind(Text{text}, Text{is_private ? "1" : ""}, Text{id})
        .run();
  });
}

void RegistryFile::remove(const std::string& id) {
  const std::lock_guard lock(mutex_);
  used([&] { Statement(database_, "DELETE FROM datasets WHERE id = ?").bind(Text{id}).run(); });
  checkpoint();
}

bool RegistryFile::remove_failed(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const bool removed = used([&] {
    const std::string failed = to_string(State::failed);
    Statement(database_, "DELETE FROM datasets WHERE id = ? AND state = ?").bind(Text{id}, Text{failed}).run();
    return database_.integer("SELECT changes()") > 0;
  });
  checkpoint();
  return removed;
}

void RegistryFile::compact() {
  const std::lock_guard lock(mutex_);
  used([&] { database_.execute("VACUUM; PRAGMA wal_checkpoint(TRUNCATE)"); });
}

Row RegistryFile::find_where(const std::string& column, const std::string& value) const {
  const std::lock_guard lock(mutex_);
  return used([&]() -> Row {
    Statement select(database_, std::string(kColumns) + "WHERE " + column + " = ?");
    select.bind(Text{value});
    Row row = select.step() ? dataset_from(select) : nullptr;
    return row && stays_in_its_folder(*row) ? row : nullptr;
  });
}

/// Whoever copies or restores the file without its log has the row. If it fails, or a backup reads meanwhile, the next one does
/// it: the row is on disk all the same.
void RegistryFile::checkpoint() try { database_.execute("PRAGMA wal_checkpoint(PASSIVE)"); } catch (const std::exception&) {
}

}  // namespace cordillera::server
