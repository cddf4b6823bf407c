#include "pipeline/check/store_laws.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <set>
#include <string>

#include "pipeline/plan/plan.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/store/store_revise.h"
#include "pipeline/store/store_schema.h"
#include "pipeline/work/work_plan.h"

namespace cordillera::pipeline::check {
namespace {

constexpr std::array kTables = {"meta", "tiles", "blobs", "nodes", "water", "lost", "meshes", "tasks"};

class Tables {
 public:
  Tables(Database& database, const proto::Plan& plan, Findings& findings)
      : database_(database), plan_(plan), findings_(findings) {}

  void strangers() {
    Statement rows(database_, "SELECT type, name FROM sqlite_schema WHERE name NOT LIKE 'sqlite^_%' ESCAPE '^' ORDER BY name");
    while (rows.step()) {
      const std::string type(rows.blob(0)), name(rows.blob(1));
      const bool known = type == "table" && std::find(kTables.begin(), kTables.end(), name) != kTables.end();
      if (!known)
        findings_.add(type + " " + name,
                      "no store has it; expected: the tables meta, tiles, blobs and nodes, and water, lost and meshes where they "
                      "are needed");
    }
  }

  /// Format 1 keeps both encodings of a tile, format 2 makes the .glb; what was built in one and continued in the other says 2.
  void format() {
    if (database_.integer("PRAGMA user_version") != kOldestSchema) return;
    const auto without = database_.integer("SELECT count(*) FROM tiles WHERE length(glb) = 0");
    if (without > 0) {
      findings_.add("format", "it is " + std::to_string(kOldestSchema) + ", and " + counted(without, "tile") +
                                  " without a stored .glb; expected: " + std::to_string(kSchemaVersion) +
                                  ", in which it is made from the .drc");
    }
  }

  void tasks() {
    if (has("tasks"))
      findings_.add("table tasks",
                    counted(rows_of("tasks"), "row") + " of a build that is over; expected: no such table in a published store");
  }

  void meshes() {
    const auto kept = kept_tasks();
    if (!kept) {
      if (has("meshes") && !noted_)
        findings_.add("table meshes", counted(rows_of("meshes"), "row") +
                                          " of a build that is over; expected: no such table in a store that is not built on");
      return;
    }
    if (!has("meshes"))
      return findings_.add("table meshes", "it is missing; expected: what the tasks of the note '" + std::string(kTasksNote) +
                                               "' left for those above");
    std::int64_t files = 0, strangers = 0;
    Statement rows(database_, "SELECT level, x, y, length(bytes) FROM meshes");
    while (rows.step()) {
      // The hash of a file beside a store that is being built; no mesh is as short.
      files += rows.integer(3) == static_cast<std::int64_t>(kHashBytes);
      strangers += !kept->contains({static_cast<int>(rows.integer(0)), static_cast<std::int32_t>(rows.integer(1)),
                                    static_cast<std::int32_t>(rows.integer(2))});
    }
    if (files > 0)
      findings_.add("table meshes", counted(files, "row") + " with the name of a build's file; expected: meshes, whole");
    if (strangers > 0)
      findings_.add("table meshes", counted(strangers, "row") + " of tasks that the note '" + std::string(kTasksNote) +
                                        "' does not have; expected: rows of its tasks");
  }

 private:
  bool has(const std::string& table) {
    return database_.integer("SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name = '" + table + "'") != 0;
  }
  std::int64_t rows_of(const std::string& table) { return database_.integer("SELECT count(*) FROM " + table); }
  static std::string counted(std::int64_t count, const std::string& what) {
    return "it has " + std::to_string(count) + " " + what + (count == 1 ? "" : "s");
  }

  /// Of a store that is built on; nothing in others, and where the note is wrong, which is told.
  std::optional<std::set<proto::TileAddress>> kept_tasks() {
    Statement row(database_, "SELECT value FROM meta WHERE key = CAST(? AS TEXT)");
    noted_ = row.bind(std::string(kTasksNote)).step();
    if (!noted_) return std::nullopt;
    proto::WorkPlan work;
    const std::string where = "note " + std::string(kTasksNote);
    if (!work.ParseFromArray(row.blob(0).data(), static_cast<int>(row.blob(0).size()))) {
      findings_.add(where, "it cannot be read; expected: the plan of the build, with its tasks");
      return std::nullopt;
    }
    if (work.format() == 0 || work.format() > kPlanFormat)
      findings_.add(where, "its format is " + std::to_string(work.format()) + "; expected: up to " + std::to_string(kPlanFormat));
    if (work.format() != kPlanFormat) return std::nullopt;
    if (work.plan().SerializeAsString() != plan_.SerializeAsString())
      findings_.add(where, "it is of another plan; expected: the plan in meta");
    std::set<proto::TileAddress> tasks;
    for (const proto::WorkStage& stage : work.stages()) {
      for (const proto::WorkTask& task : stage.tasks()) tasks.insert(work::address_of(task));
    }
    return tasks;
  }

  Database& database_;
  const proto::Plan& plan_;
  Findings& findings_;
  bool noted_ = false;
};

}  // namespace

void check_tables(Database& database, const proto::Plan& plan, Findings& findings) {
  Tables tables(database, plan, findings);
  tables.strangers();
  tables.format();
  tables.tasks();
  tables.meshes();
}

void check_version_note(Database& database, const std::string& path, Findings& findings) {
  std::error_code error;
  if (!std::filesystem::exists(std::filesystem::path(path).parent_path() / kChangesFile, error)) return;
  const std::string where = "note " + std::string(kVersionNote);
  Statement row(database, "SELECT value FROM meta WHERE key = CAST(? AS TEXT)");
  if (!row.bind(std::string(kVersionNote)).step()) {
    return findings.add(where, "it is missing, and beside the store lies " + std::string(kChangesFile) +
                                   "; expected: the rasters that the store was made of");
  }
  proto::DatasetVersion version;
  if (version.ParseFromArray(row.blob(0).data(), static_cast<int>(row.blob(0).size())) && version.number() > 0 &&
      version.sources_size() > 0)
    return;
  findings.add(where, "it cannot be read; expected: the rasters that the store was made of");
}

void check_manifest(const proto::Manifest& expected, const proto::Manifest& found, const proto::Plan& plan, Findings& findings) {
  const auto same = [&](const char* name, const std::string& there, const std::string& wanted) {
    if (there != wanted) findings.add("manifest", std::string(name) + " is '" + there + "'; expected: '" + wanted + "'");
  };
  const auto number = [&](const char* name, std::uint64_t there, std::uint64_t wanted) {
    same(name, std::to_string(there), std::to_string(wanted));
  };
  same("program", found.program(), plan.program());
  same("height_datum", found.height_datum(), expected.height_datum());
  same("drc_formula", found.drc_formula(), expected.drc_formula());
  number("min_level", found.min_level(), expected.min_level());
  number("max_level", found.max_level(), expected.max_level());
  number("tiles", found.tiles(), expected.tiles());
  number("triangles", found.triangles(), expected.triangles());
  proto::Manifest rest = found;
  rest.set_height_datum(expected.height_datum());
  rest.set_drc_formula(expected.drc_formula());
  rest.set_min_level(expected.min_level());
  rest.set_max_level(expected.max_level());
  rest.set_tiles(expected.tiles());
  rest.set_triangles(expected.triangles());
  if (rest.SerializeAsString() != expected.SerializeAsString())
    findings.add("manifest", "its levels, sums or bounds are not those of the tiles");
}

}  // namespace cordillera::pipeline::check
