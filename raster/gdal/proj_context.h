#pragma once
// Our own contexts of PROJ, and whether its tables (proj.db) could be read. Where they cannot, PROJ goes on as if they had no
// answer: what it says meanwhile is the only sign.
#include <cstdint>
#include <memory>
#include <string_view>

struct pj_ctx;

namespace cordillera::raster {

struct CloseProjContext {
  void operator()(pj_ctx* context) const;
};
using ProjContext = std::unique_ptr<pj_ctx, CloseProjContext>;

/// Without network, and with the operator's folders before PROJ's own. It shows nothing; what it says of its tables counts in
/// the thread that uses it.
ProjContext make_proj_context();

enum class Said : std::uint8_t { aside, as_error };
/// What PROJ said in this thread, without a prefix. Of a statement that SQLite refuses it may speak aside alone.
void hear_proj(std::string_view message, Said how);

/// Whether PROJ could not read its tables in this thread since forget_proj(): it said so, or it complained of something and a
/// well-known CRS cannot be made either.
bool proj_tables_failed();
void forget_proj();

}  // namespace cordillera::raster
