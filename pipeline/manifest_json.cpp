#include "pipeline/manifest_json.h"

#include <google/protobuf/util/json_util.h>

#include <stdexcept>

namespace cordillera::pipeline {

std::string manifest_json(const proto::Manifest& manifest) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  options.add_whitespace = true;
  std::string out;
  const auto status = google::protobuf::util::MessageToJsonString(manifest, &out, options);
  if (!status.ok()) throw std::logic_error("a manifest cannot be printed: " + status.ToString());
  return out;
}

proto::Result<proto::Manifest> parse_manifest_json(const std::string& json) {
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  proto::Manifest manifest;
  const auto status = google::protobuf::util::JsonStringToMessage(json, &manifest, options);
  if (!status.ok()) return proto::Problem{"manifest-damaged", "not a manifest: " + status.ToString(), "a manifest.json of Cordillera", ""};
  return manifest;
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
