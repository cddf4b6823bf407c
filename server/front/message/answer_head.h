#pragma once
// The head of an answer.
#include <cstdint>
#include <string>
#include <string_view>

#include "server/http/message.h"

namespace cordillera::server::front {

/// How the end of an answer's body is known.
enum class Ending : std::uint8_t { length, chunks, connection };

struct AnswerForm {
  Ending ending = Ending::length;
  bool keep_alive = true;
  bool old = false;            ///< the request was HTTP/1.0, which must be told that the connection stays
  std::string_view date = {};  ///< as HTTP has it
};

/// Appends a header's line. What is no text in its value is left out.
void add_header(std::string& out, std::string_view name, std::string_view value);
/// Status line and headers, the empty line included. What is no text in a header's value is left out.
std::string answer_head(const Response& response, const AnswerForm& form);
/// Statuses that never have a body.
bool is_bodiless(int status);
/// Sun, 06 Nov 1994 08:49:37 GMT
std::string http_date();

}  // namespace cordillera::server::front
