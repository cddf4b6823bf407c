#include "server/options/request_policy.h"

#include <algorithm>
#include <filesystem>

#include "gpu/simplify.h"
#include "pipeline/plan/plan.h"
#include "proto/cores.h"
#include "server/memory/memory_limit.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

/// A grid is named by its file name alone; raster looks for it in the operator's folders.
std::optional<proto::Problem> check_datum(const proto::BuildOptions& options) {
  const std::string& datum = options.vertical_datum();
  if (datum.find_first_of("/\\") == std::string::npos) return std::nullopt;
  return proto::Problem{"option-forbidden", "vertical_datum='" + datum + "' names a path",
                        "EGM96, EGM2008, EGM84, ellipsoid, a height system by name or code, or the bare name of a grid in the "
                        "operator's geoid folder",
                        "vertical_datum"};
}

/// PROJ and GDAL read a CRS from files and the network if its text names one.
std::optional<proto::Problem> check_crs(const proto::BuildOptions& options) {
  const std::string& crs = options.crs();
  const auto has = [&](const char* text) { return crs.find(text) != std::string::npos; };
  const bool text = has("[") || has("{");  // WKT and PROJJSON hold addresses as plain identifiers
  const bool names_file = has("grids=") || has("init=") || has("file=") ||
                          (!text && (has("://") || has("/vsi") || crs.rfind("/", 0) == 0 || crs.rfind(".", 0) == 0 ||
                                     fs::path(crs).has_parent_path()));
  std::error_code error;
  if (!names_file && (text || !fs::is_regular_file(crs, error))) return std::nullopt;
  return proto::Problem{"option-forbidden", "crs must not name files or addresses",
                        "a code such as EPSG:32632, WKT or a PROJ string", "crs"};
}

/// The service reads no file that a request names.
std::optional<proto::Problem> check_water_mask(const Settings& server, const proto::BuildOptions& options) {
  if (options.water_mask() == server.build.water_mask()) return std::nullopt;
  return proto::Problem{"option-forbidden", "water_mask names a file of the server's machine",
                        "water= with the height of the sea in the raster, such as water=0, or water-mask on the command line",
                        "water_mask"};
}

/// most: what the operator gives a build; 0: usual, which is what it takes where nobody asks for more.
std::uint32_t within(std::uint32_t wanted, std::uint32_t most, std::uint32_t usual) {
  return wanted == 0 ? most : std::min(wanted, most == 0 ? usual : most);
}

}  // namespace

std::optional<proto::Problem> check_names(const proto::BuildOptions& options) {
  if (auto refused = check_crs(options)) return refused;
  return check_datum(options);
}

std::optional<proto::Problem> apply_policy(const Settings& server, proto::BuildOptions& options) {
  if (auto refused = gpu::check_strategy(pipeline::named_strategy(options), options.device())) return refused;
  if (auto refused = check_crs(options)) return refused;
  if (auto refused = check_water_mask(server, options)) return refused;
  options.set_threads(within(options.threads(), server.build.threads(), proto::usable_cores()));
  options.set_memory(within(options.memory(), server.build.memory(), default_memory_mib(options)));
  return check_datum(options);
}

}  // namespace cordillera::server
