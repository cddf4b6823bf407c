#include "server/front/message/answer_head.h"

#include <array>
#include <ctime>

#include "server/front/message/beast.h"

namespace cordillera::server::front {

void add_header(std::string& out, std::string_view name, std::string_view value) {
  out.append(name).append(": ");
  const std::size_t start = out.size();
  out.append(value);
  // A line end in a value would be the end of its header.
  for (std::size_t i = start; i < out.size(); ++i) {
    if (static_cast<unsigned char>(out[i]) < 0x20 || out[i] == 0x7f) out[i] = ' ';
  }
  out.append("\r\n");
}

bool is_bodiless(int status) { return status == 204 || status == 304 || status < 200; }

std::string answer_head(const Response& response, const AnswerForm& form) {
  std::string out;
  out.reserve(640);
  out.append("HTTP/1.1 ").append(std::to_string(response.status)).append(" ").append(reason_of(response.status)).append("\r\n");
  if (!form.date.empty()) add_header(out, "Date", form.date);
  add_header(out, "Server", "Cordillera");
  if (response.header("Accept-Ranges").empty()) add_header(out, "Accept-Ranges", "none");
  bool typed = response.lines != nullptr;
  if (response.lines) out.append(*response.lines);
  for (const auto& [name, value] : response.headers) {
    typed = typed || name == "Content-Type";
    add_header(out, name, value);
  }
  const std::uint64_t length = response.length.value_or(response.bytes().size());
  if (!is_bodiless(response.status)) {
    if (!typed && (form.ending != Ending::length || length > 0)) add_header(out, "Content-Type", "application/octet-stream");
    if (form.ending == Ending::length) add_header(out, "Content-Length", std::to_string(length));
    if (form.ending == Ending::chunks) add_header(out, "Transfer-Encoding", "chunked");
  }
  if (!form.keep_alive) add_header(out, "Connection", "close");
  if (form.keep_alive && form.old) add_header(out, "Connection", "keep-alive");
  return out.append("\r\n");
}

std::string http_date() {
  static constexpr const char* kDays[] = {"Sun", "Mon", "Tue", "Wed", "Thu", "Fri", "Sat"};
  static constexpr const char* kMonths[] = {"Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"};
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 40> text{};
  // The names are English whatever the locale.
  std::strftime(text.data(), text.size(), "%d %%s %Y %H:%M:%S GMT", &utc);
  std::string date = std::string(kDays[utc.tm_wday]) + ", " + text.data();
  return date.replace(date.find("%s"), 2, kMonths[utc.tm_mon]);
}

}  // namespace cordillera::server::front
