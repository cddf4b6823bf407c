#include "pipeline/tileset/manifest_json.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "pipeline/encode/json.h"
#include "pipeline/tileset/print_options.h"
#include "proto/files.h"

namespace cordillera::pipeline {
namespace {

/// Nobody has measured these of provisional tiles.
void leave_out_errors(Json& manifest) {
  for (Json& level : manifest["levels"]) level["stated_max_error"] = level["rmse"] = nullptr;
  manifest["source"]["error_at_pixels"] = nullptr;
}

/// A level without tiles is nowhere: it has no heights, and no error.
void leave_out_nothing_shown(const proto::Manifest& manifest, Json& levels) {
  for (int k = 0; k < manifest.levels_size(); ++k) {
    if (manifest.levels(k).tiles() > 0) continue;
    for (const char* name : {"stated_max_error", "min_height", "max_height"}) levels[static_cast<std::size_t>(k)][name] = nullptr;
  }
}

/// Heights are those of the whole: of one raster among several only what was read of its file is known.
void leave_out_measurements(Json& source) {
  for (const char* name : {"nodata_share", "flat_water_share", "min_height", "max_height", "filled_share", "lattice_samples"})
    source.erase(name);
}

}  // namespace

std::string manifest_json(const proto::Manifest& manifest) {
  google::protobuf::util::JsonPrintOptions options;
  print_all_fields(options);
  std::string out;
  const auto status = google::protobuf::util::MessageToJsonString(manifest, &out, options);
  if (!status.ok()) throw std::logic_error("a manifest cannot be printed: " + status.ToString());
  Json json = Json::parse(out);
  if (manifest.provisional()) leave_out_errors(json);
  leave_out_nothing_shown(manifest, json["levels"]);
  for (int k = 0; k < manifest.sources_size(); ++k) {
    if (manifest.sources(k).lattice_samples() == 0) leave_out_measurements(json["sources"][static_cast<std::size_t>(k)]);
  }
  if (!has_one_size(manifest)) {
    for (const char* side : {"columns", "rows"}) json["source"].erase(side);
  }
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

bool has_one_size(const proto::Manifest& manifest) {
  const proto::Source& all = manifest.source();
  return std::all_of(manifest.sources().begin(), manifest.sources().end(),
                     [&](const proto::Source& one) { return one.columns() == all.columns() && one.rows() == all.rows(); });
}

proto::Result<proto::Manifest> parse_manifest_json(const std::string& json) {
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  proto::Manifest manifest;
  const auto status = google::protobuf::util::JsonStringToMessage(json, &manifest, options);
  if (!status.ok())
    return proto::Problem{"manifest-damaged", "not a manifest: " + status.ToString(), "a manifest.json of Cordillera", ""};
  return manifest;
}

proto::Result<proto::Manifest> manifest_of_folder(const std::string& folder) {
  return parse_manifest_json(proto::bytes_of_file(std::filesystem::path(folder) / "manifest.json").value_or(""));
}

std::string compact_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string out;
  if (!google::protobuf::util::MessageToJsonString(message, &out, options).ok()) out.clear();
  return out;
}

bool parse_json(const std::string& json, google::protobuf::Message* message) {
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  return google::protobuf::util::JsonStringToMessage(json, message, options).ok();
}

}  // namespace cordillera::pipeline
