#include "server/http/json.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/json_util.h>

#include <cmath>
#include <string_view>

#include "pipeline/tileset/print_options.h"
#include "proto/utf8.h"
#include "server/http/problems.h"

namespace cordillera::server {
namespace {

// Of a problem that a job reports or that is written down: it stands in every list. Both ways, for a job may have been taken
// over.
constexpr std::size_t kMostKept_bytes = 2000, kLongestSlug_bytes = 100;

/// When it is worth to ask again; null: asking again changes nothing. Here alone: a header that stands twice is read as none.
const char* retry_after_s(const proto::Problem& problem, int status) {
  const std::string_view slug = problem.type;
  if (slug == "dataset-not-ready" || slug == "tile-not-ready") return "2";  // most steps and blocks are made in a few seconds
  if (slug == "queue-full") return "30";
  if (slug == "idempotency-key-in-use" || slug == "dataset-changing") return "5";
  // Another request is writing. Of the others the parameter says what to send instead.
  if (slug == "upload-conflict" && problem.parameter.empty()) return "5";
  return status == 503 || status == 429 ? "5" : nullptr;
}

std::string kept(const std::string& text) { return proto::cut_text(proto::one_line(text), kMostKept_bytes); }

Json schema_of(const google::protobuf::Descriptor& message);

Json schema_of(const google::protobuf::FieldDescriptor& field) {
  using google::protobuf::FieldDescriptor;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE: return schema_of(*field.message_type());
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_FLOAT: return {{"type", "number"}};
    case FieldDescriptor::CPPTYPE_INT32:
    case FieldDescriptor::CPPTYPE_UINT32: return {{"type", "integer"}};
    case FieldDescriptor::CPPTYPE_BOOL: return {{"type", "boolean"}};
    default: return {{"type", "string"}};  // 64 bits, too
  }
}

/// A message that has itself within has no end here.
Json schema_of(const google::protobuf::Descriptor& message) {
  Json members = Json::object();
  for (int k = 0; k < message.field_count(); ++k) {
    const google::protobuf::FieldDescriptor& field = *message.field(k);
    Json one = schema_of(field);
    members[std::string(field.name())] =
        field.is_repeated() ? Json{{"type", "array"}, {"items", std::move(one)}} : std::move(one);
  }
  return {{"type", "object"}, {"properties", std::move(members)}};
}

}  // namespace

std::string to_json_line(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  pipeline::print_all_fields(options);
  std::string text;
  (void)google::protobuf::util::MessageToJsonString(message, &text, options);
  return text;
}

Json to_json(const google::protobuf::Message& message) { return Json::parse(to_json_line(message), nullptr, false); }

Json schema_of_json(const google::protobuf::Message& message) { return schema_of(*message.GetDescriptor()); }

bool from_json(const std::string& text, google::protobuf::Message* message, Unknown unknown) {
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = unknown == Unknown::ignored;
  return google::protobuf::util::JsonStringToMessage(text, message, options).ok();
}

Json problem_json(const proto::Problem& problem) {
  const ProblemKind kind = problem_kind(problem.type);
  Json json;
  json["type"] = "urn:cordillera:problem:" + kind.slug;
  json["title"] = kind.title;
  json["status"] = kind.status;
  json["detail"] = problem.detail;
  if (!problem.accepted.empty()) json["accepted"] = problem.accepted;
  if (!problem.parameter.empty()) json["parameter"] = problem.parameter;
  return json;
}

proto::Error to_error(const proto::Problem& problem) {
  proto::Error error;
  error.set_type(proto::cut_text(problem.type, kLongestSlug_bytes));
  error.set_detail(kept(problem.detail));
  error.set_accepted(kept(problem.accepted));
  error.set_parameter(kept(problem.parameter));
  return error;
}

proto::Problem to_problem(const proto::Error& error) {
  return {proto::cut_text(error.type(), kLongestSlug_bytes), kept(error.detail()), kept(error.accepted()),
          kept(error.parameter())};
}

Json plain_numbers(Json json) {
  constexpr double kExact = 9007199254740992;  // up to here a double holds every integer
  if (json.is_structured()) {
    for (Json& part : json) part = plain_numbers(std::move(part));
  } else if (json.is_number_float()) {
    const double value = json.get<double>();
    if (value == std::floor(value) && std::abs(value) < kExact) return static_cast<std::int64_t>(value);
  }
  return json;
}

std::string dump(Json json) { return plain_numbers(std::move(json)).dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

std::string ListText::item(Json json) {
  const std::string lines = dump(std::move(json));
  std::string text;
  for (std::size_t from = 0, to = 0; to + 1 < lines.size(); from = to + 1) {
    if (from > 0) text += "\n    ";
    to = lines.find('\n', from);
    text.append(lines, from, to - from);
  }
  return text;
}

void ListText::add(const std::string& item) {
  text_.append(empty_ ? "\n    " : ",\n    ").append(item);
  empty_ = false;
}

std::string ListText::end(const std::string& name, const Json& value) {
  text_.append(empty_ ? "]" : "\n  ]")
      .append(",\n  ")
      .append(Json(name).dump())
      .append(": ")
      .append(value.dump())
      .append("\n}\n");
  return std::move(text_);
}

Response json_response(int status, Json body) { return json_text_response(status, dump(std::move(body))); }

Response json_text_response(int status, std::string text) {
  Response response;
  response.status = status;
  response.set("Content-Type", "application/json");
  response.body = std::move(text);
  return response;
}

Response problem_response(const proto::Problem& problem) {
  Response response = json_response(problem_kind(problem.type).status, problem_json(problem));
  response.headers = {{"Content-Type", "application/problem+json"}, {"Cache-Control", "no-store"}};
  response.problem = problem.type;
  if (const char* seconds = retry_after_s(problem, response.status)) response.set("Retry-After", seconds);
  return response;
}

}  // namespace cordillera::server
