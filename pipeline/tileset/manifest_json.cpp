#include "pipeline/tileset/manifest_json.h"

#include <google/protobuf/util/json_util.h>

#include <filesystem>
#include <stdexcept>

#include "pipeline/encode/json.h"
#include "pipeline/tileset/print_options.h"
#include "proto/files.h"

namespace cordillera::pipeline {
namespace {

/// Without what nobody has measured of provisional tiles.
std::string without_errors(const std::string& manifest) {
  Json json = Json::parse(manifest);
  for (Json& level : json["levels"]) level["stated_max_error"] = level["rmse"] = nullptr;
  json["source"]["error_at_pixels"] = nullptr;
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string manifest_json(const proto::Manifest& manifest) {
  google::protobuf::util::JsonPrintOptions options;
  print_all_fields(options);
  options.add_whitespace = true;
  std::string out;
  const auto status = google::protobuf::util::MessageToJsonString(manifest, &out, options);
  if (!status.ok()) throw std::logic_error("a manifest cannot be printed: " + status.ToString());
  return manifest.provisional() ? without_errors(out) : out;
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
