#pragma once
// JSON of the service: proto messages in proto's JSON with their field names and defaults printed, problems as RFC 9457 has them.
#include <cstdint>
#include <string>

#include "cordillera.pb.h"
#include "pipeline/encode/json.h"
#include "proto/result.h"
#include "server/http/message.h"

namespace cordillera::server {

using pipeline::Json;

/// One line of JSON. Doubles that are not finite and text that is not UTF-8 do not occur in our messages.
std::string to_json_line(const google::protobuf::Message& message);
Json to_json(const google::protobuf::Message& message);
/// JSON Schema of what to_json() makes of such messages.
Json schema_of_json(const google::protobuf::Message& message);
/// What is done about members that the message does not have. A later program may have written the text.
enum class Unknown : std::uint8_t { ignored, refused };
/// False if the text is not such a message.
bool from_json(const std::string& text, google::protobuf::Message* message, Unknown unknown = Unknown::ignored);

/// type, title, status, detail, accepted, parameter.
Json problem_json(const proto::Problem& problem);

proto::Error to_error(const proto::Problem& problem);
proto::Problem to_problem(const proto::Error& error);

Response json_response(int status, Json body);
/// The media type of the API's description.
inline constexpr const char* kOpenApiType = "application/vnd.oai.openapi+json;version=3.1";
/// An answer whose JSON is text already.
Response json_text_response(int status, std::string text);
Response problem_response(const proto::Problem& problem);
/// Whole numbers as integers: 508841, not 508841.0.
Json plain_numbers(Json json);
/// Text for humans and machines, with plain numbers: bytes that are not UTF-8 are replaced.
std::string dump(Json json);

/// What dump() makes of an object whose first member is an array, an item at a time: a tree of a thousand datasets would take ten
/// megabytes.
class ListText {
 public:
  /// An item as it stands in the list.
  static std::string item(Json json);
  explicit ListText(const std::string& name) : text_("{\n  " + Json(name).dump() + ": [") {}
  void add(const std::string& item);
  /// The whole, once, with one more member.
  std::string end(const std::string& name, const Json& value);

 private:
  std::string text_;
  bool empty_ = true;
};

}  // namespace cordillera::server
