#include "pipeline/store/store_sums.h"

#include "pipeline/store/content_hash.h"

namespace cordillera::pipeline {
namespace {

bool has_column(Database& database, const std::string& table) {
  return database.integer("SELECT count(*) FROM pragma_table_info('" + table + "') WHERE name = 'sum'") != 0;
}

void add_sum(Database& database, const std::string& table, const std::string& columns) {
  if (database.integer("SELECT count(*) FROM sqlite_schema WHERE name = '" + table + "'") == 0 || has_column(database, table))
    return;
  database.execute("ALTER TABLE " + table + " ADD COLUMN sum INT; UPDATE " + table + " SET sum = row_sum(" + columns + ")");
}

}  // namespace

bool has_sums(Database& database) { return has_column(database, "tiles"); }

void add_sums(Database& database) {
  if (has_sums(database)) return;
  add_sum(database, "meta", "key, value");
  add_sum(database, "water", "level, y, x, mask");
  add_sum(database, "tiles", "level, y, x, record, drc, glb");  // last: it says that all are there
}

void require_sound(std::string_view bytes, std::string_view hash) {
  if (content_hash(bytes) != hash) throw StoreError("bytes " + hex(hash) + " are not as they were written");
}

}  // namespace cordillera::pipeline
