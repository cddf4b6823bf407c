#include <array>
#include <optional>

#include "pipeline/check/border_laws.h"
#include "pipeline/check/check.h"
#include "pipeline/check/error_laws.h"
#include "pipeline/check/store_laws.h"
#include "pipeline/encode/tile_glb.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store.h"
#include "pipeline/store/store_publish.h"
#include "pipeline/store/store_schema.h"
#include "pipeline/store/store_sums.h"

namespace cordillera::pipeline::check {
namespace {

class StoreCheck {
 public:
  StoreCheck(const std::string& path, const proto::Manifest& manifest, const ProgressCallback& progress, Report& report)
      : database_(path, Database::Mode::published), manifest_(manifest), progress_(progress), report_(report) {}

  /// The file's own structure first: what is read through a broken index proves nothing.
  bool pages(const char* how = "PRAGMA integrity_check(20)") {
    progress_.stage("pages", 0);
    Statement rows(database_, how);
    bool sound = true;
    while (rows.step()) {
      if (rows.blob(0) == "ok") continue;
      sound = false;
      report_.findings.add("file", std::string(rows.blob(0)));
    }
    return sound;
  }

  bool plan() {
    Statement row(database_, "SELECT value FROM meta WHERE key = 'plan'");
    const bool read = row.step() && plan_.ParseFromArray(row.blob(0).data(), static_cast<int>(row.blob(0).size()));
    if (!read || plan_.finest_level() > proto::kMaxLevel) {
      report_.findings.add("plan", "it is missing or cannot be read");
      return false;
    }
    if (plan_.SerializeAsString() != row.blob(0)) report_.findings.add("plan", "it holds what no plan has");
    return true;
  }

  /// Rows that are not as they were written: what a server would refuse to serve, and what it never reads.
  void sums() {
    if (!has_sums(database_)) return;
    for (const auto& [table, name, sound] : {std::array{"meta", "key", kSoundMeta},
                                             {"tiles", "level || '/' || x || '/' || y", kSoundTile},
                                             {"water", "level || '/' || x || '/' || y", kSoundWater},
                                             {"nodes", "level || '/' || x || '/' || y", kSoundNode}}) {
      if (database_.integer("SELECT count(*) FROM sqlite_schema WHERE name = '" + std::string(table) + "'") == 0) continue;
      Statement rows(database_, "SELECT " + std::string(name) + " FROM " + table + " WHERE NOT (" + sound + ")");
      while (rows.step())
        report_.findings.add(std::string(table) + " " + std::string(rows.blob(0)), "this row is not as it was written");
    }
  }

  void tables() { check_tables(database_, plan_, report_.findings); }
  void version_note(const std::string& path) { check_version_note(database_, path, report_.findings); }

  void checksums() {
    progress_.stage("checksums", static_cast<double>(database_.integer("SELECT count(*) FROM blobs")));
    Statement rows(database_, "SELECT hash, bytes FROM blobs");
    while (rows.step()) {
      progress_.tell(static_cast<double>(++report_.checksums));
      const std::string hash(rows.blob(0));
      if (content_hash(rows.blob(1)) != hash) report_.findings.add("bytes " + hex(hash), "they are not those of their name");
    }
    report_.unreferenced = static_cast<std::uint64_t>(database_.integer(
        "SELECT count(*) FROM blobs WHERE hash NOT IN (SELECT drc FROM tiles UNION ALL SELECT glb FROM tiles)"));
  }

  void tiles(ErrorLaws* errors) {
    progress_.stage("tiles", static_cast<double>(database_.integer("SELECT count(*) FROM tiles")));
    for (const proto::LevelPlan& level : plan_.levels()) {
      BorderLaws borders(static_cast<int>(level.level()), report_);
      Statement rows(
          database_,
          "SELECT t.y, t.x, t.record, d.bytes, g.bytes, t.error, t.west, t.south, t.east, t.north, t.low, t.high, t.glb FROM "
          "tiles t "
          "LEFT JOIN blobs d ON d.hash = t.drc LEFT JOIN blobs g ON g.hash = t.glb WHERE t.level = ? ORDER BY t.y, t.x");
      rows.bind(level.level());
      while (rows.step()) {
        auto tile = one(rows, level);
        progress_.tell(static_cast<double>(seen_));
        if (!tile) continue;
        if (errors != nullptr) errors->add(*tile, rows.real(5), report_);
        borders.add(*tile);
      }
      borders.finish();
    }
    const auto planned = static_cast<std::uint64_t>(database_.integer("SELECT count(*) FROM tiles"));
    if (planned != seen_)
      report_.findings.add("tiles", std::to_string(planned - seen_) + " are of levels that the plan does not have");
  }

  void nodes() {
    Database scratch(":memory:", Database::Mode::scratch);
    // The same statement that made them, over a copy of the tiles: what differs was not made from these tiles.
    scratch.execute(kCreateTables);
    Statement put(scratch, "INSERT INTO tiles VALUES(?, ?, ?, '', '', '', ?, ?, ?, ?, ?, ?, ?, NULL)");
    Statement tile(database_, "SELECT level, y, x, error, west, south, east, north, low, high FROM tiles");
    while (tile.step()) {
      put.bind(tile.integer(0), tile.integer(1), tile.integer(2), tile.real(3), tile.real(4), tile.real(5), tile.real(6),
               tile.real(7), tile.real(8), tile.real(9))
          .run();
    }
    make_nodes(scratch, static_cast<int>(plan_.finest_level()));
    const std::string all = "SELECT level, y, x, error, west, south, east, north, low, high FROM nodes ORDER BY level, y, x";
    Statement expected(scratch, all), found(database_, all);
    while (true) {
      const bool more = expected.step(), there = found.step();
      if (!more && !there) return;
      bool same = more && there;
      for (int k = 0; same && k < 3; ++k) same = expected.integer(k) == found.integer(k);
      for (int k = 3; same && k < 10; ++k) same = expected.real(k) == found.real(k);
      if (same) continue;
      return report_.findings.add("nodes", "errors and regions of the tree are not those of the tiles below");
    }
  }

  /// Everything that is summed over tiles, summed again.
  void manifest() {
    proto::Manifest again = manifest_;
    summarise(database_, plan_, again);
    check_manifest(again, manifest_, plan_, report_.findings);
    for (const proto::LevelSummary& level : manifest_.levels()) {
      // A rim may leave no room for the promise; then the README says to compare both, and so both must be there.
      if (level.tiles() > 0 && !(level.geometric_error() >= level.stated_max_error())) {
        report_.findings.add("level " + std::to_string(level.level()), "its geometric error is below its stated error");
      }
    }
  }

  const proto::Plan& known_plan() const { return plan_; }

 private:
  std::optional<CheckedTile> one(const Statement& row, const proto::LevelPlan& level) {
    ++seen_;
    const proto::TileAddress at{static_cast<int>(level.level()), static_cast<std::int32_t>(row.integer(1)),
                                static_cast<std::int32_t>(row.integer(0))};
    proto::TileRecord record;
    if (!record.ParseFromArray(row.blob(2).data(), static_cast<int>(row.blob(2).size()))) {
      report_.findings.add(name_of(at), "its record cannot be read");
      return std::nullopt;
    }
    const bool made = row.blob(12).empty();  // on request, and here
    if (row.blob(3).empty() || (row.blob(4).empty() && !made)) {
      report_.findings.add(name_of(at), "its bytes are missing");
      return std::nullopt;
    }
    check_columns(row, record, at);
    ++report_.tiles;
    const auto glb = made ? tile_glb(plan_, record, row.blob(3)) : proto::Result<std::string>(std::string(row.blob(4)));
    if (!glb) {
      report_.findings.add(name_of(at), glb.problem().detail);
      return std::nullopt;
    }
    return check_tile({at, static_cast<int>(plan_.finest_level()), row.blob(3), *glb, &record, ecef_steps(level),
                       height_step(level) * proto::kHeightStep_m},
                      report_.findings);
  }

  void check_columns(const Statement& row, const proto::TileRecord& record, const proto::TileAddress& at) {
    bool same = record.level() == static_cast<std::uint32_t>(at.z) && record.x() == static_cast<std::uint32_t>(at.x) &&
                record.y() == static_cast<std::uint32_t>(at.y) && record.max_error() == row.real(5);
    for (int k = 0; same && k < record.region_size(); ++k) same = record.region(k) == row.real(6 + k);
    if (!same) report_.findings.add(name_of(at), "its row and its record differ");
  }

  Database database_;
  const proto::Manifest& manifest_;
  Teller progress_;
  Report& report_;
  proto::Plan plan_;
  std::uint64_t seen_ = 0;
};

}  // namespace

proto::Result<Report> check_bytes(const std::string& path) {
  auto reader = StoreReader::open(path);
  if (!reader) return reader.problem();
  Report report;
  try {
    const ProgressCallback nobody;
    StoreCheck check(path, (*reader)->manifest(), nobody, report);
    if (!check.pages("PRAGMA quick_check(20)")) return report;  // the other compares indices, which takes much longer
    check.sums();
    check.checksums();
  } catch (const StoreError& e) { report.findings.add("file", e.what()); }
  return report;
}

proto::Result<Report> check_store(const std::string& path, const OpenRasters& rasters, const ProgressCallback& progress) {
  auto reader = StoreReader::open(path);
  if (!reader) return reader.problem();
  const proto::Manifest manifest = (*reader)->manifest();
  Report report;
  try {
    StoreCheck check(path, manifest, progress, report);
    if (!check.pages() || !check.plan()) return report;
    std::unique_ptr<ErrorLaws> errors;
    if (rasters) {
      auto opened = ErrorLaws::open(rasters, manifest, check.known_plan());
      if (!opened) return opened.problem();
      errors = std::move(*opened);
    }
    check.tables();
    check.version_note(path);
    check.sums();
    check.checksums();
    check.tiles(errors.get());
    if (errors) errors->finish(manifest.source(), report);
    check.nodes();
    check.manifest();
  } catch (const StoreError& e) { report.findings.add("file", e.what()); }
  return report;
}

}  // namespace cordillera::pipeline::check
