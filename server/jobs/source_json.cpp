#include "server/jobs/source_json.h"

#include "server/fetch/addresses.h"

namespace cordillera::server::updates {
namespace {

/// The options that were given to this raster.
Json options_json(const proto::BuildOptions& options) {
  Json json = Json::object();
  for (const auto& [name, value] : {std::pair{"band", options.band()},
                                    {"crs", options.crs()},
                                    {"vertical_datum", options.vertical_datum()},
                                    {"nodata", options.nodata()},
                                    {"voids", options.voids()}}) {
    if (!value.empty()) json[name] = value;
  }
  if (options.has_z_scale()) json["z_scale"] = options.z_scale();
  if (options.has_z_offset()) json["z_offset"] = options.z_offset();
  return json;
}

}  // namespace

Json source_json(const proto::DatasetSource& source, std::optional<int> position, const proto::Source* found, Shown address) {
  Json json;
  json["id"] = source.id();
  json["name"] = source.spec().name();
  json["position"] = position ? Json(*position) : Json(nullptr);
  json["bytes"] = source.bytes();
  json["added"] = source.added();
  json["options"] = options_json(source.spec().options());
  if (!source.url().empty()) json["source"] = address == Shown::whole ? source.url() : without_query(source.url());
  if (found == nullptr) return json;
  json["extent"] = std::vector<double>(found->bbox().begin(), found->bbox().end());
  json["resolution"] = {found->pixel_width_m(), found->pixel_height_m()};
  json["columns"] = found->columns();
  json["rows"] = found->rows();
  json["crs"] = found->crs();
  json["vertical_datum"] = found->vertical_datum();
  json["vertical_datum_from"] = found->vertical_datum_from();
  if (found->all_void()) json["all_void"] = true;
  return json;
}

Json change_json(const proto::SourceChange& change, const char* state) {
  Json json;
  json["id"] = change.id();
  json["kind"] = change.kind();
  json["source"] = change.source().id();
  json["state"] = state;
  json["version"] = change.number();
  json["error"] = change.has_problem() ? problem_json(to_problem(change.problem())) : Json(nullptr);
  return json;
}

}  // namespace cordillera::server::updates
