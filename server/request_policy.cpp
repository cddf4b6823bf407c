#include "server/request_policy.h"

#include <algorithm>
#include <filesystem>

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> grids_in(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  if (folder.empty()) return names;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.is_regular_file(error)) names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::optional<proto::Problem> resolve_datum(const Settings& server, proto::BuildOptions& options) {
  const std::string& datum = options.vertical_datum();
  static const std::vector<std::string> known = {"", "EGM96", "EGM2008", "EGM84", "ellipsoid"};
  const bool from_operator = datum == server.build.vertical_datum();
  if (from_operator || std::find(known.begin(), known.end(), datum) != known.end()) return std::nullopt;
  std::string accepted = "EGM96, EGM2008, EGM84, ellipsoid";
  for (const std::string& name : grids_in(server.serve.datum_grids)) {
    if (name == datum) {
      options.set_vertical_datum((fs::path(server.serve.datum_grids) / name).string());
      return std::nullopt;
    }
    accepted += ", " + name;
  }
  return proto::Problem{"option-forbidden", "vertical_datum='" + datum + "' is neither a known datum nor a grid of this service",
                        accepted, "vertical_datum"};
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
  return proto::Problem{"option-forbidden", "crs must not name files or addresses", "a code such as EPSG:32632, WKT or a PROJ string",
                        "crs"};
}

std::uint32_t within(std::uint32_t wanted, std::uint32_t most) {
  if (most == 0) return wanted;
  return wanted == 0 ? most : std::min(wanted, most);
}

}  // namespace

std::optional<proto::Problem> apply_policy(const Settings& server, proto::BuildOptions& options) {
  if (options.crs() != server.build.crs()) {
    if (auto refused = check_crs(options)) return refused;
  }
  options.set_threads(within(options.threads(), server.build.threads()));
  options.set_memory(within(options.memory(), server.build.memory()));
  return resolve_datum(server, options);
}

}  // namespace cordillera::server
