#pragma once
// Whether rows of a store are as they were written: row_sum in their column `sum` (store_schema.h), and the content hash beside
// bytes.
#include <string_view>

#include "pipeline/store/sqlite.h"

namespace cordillera::pipeline {

/// Stores of earlier versions have no sums.
bool has_sums(Database& database);
/// Gives a store that is being written the sums that it lacks: its rows are taken as they stand.
void add_sums(Database& database);

/// Throws StoreError where bytes that are about to be handed out are not those of their hash (16 bytes, as content_hash gives
/// it).
void require_sound(std::string_view bytes, std::string_view hash);

}  // namespace cordillera::pipeline
