#pragma once
// Lines to stderr, for people or as JSON. A line says which request and which dataset it belongs to: whoever begins such work
// opens a LogScope, and every line of its thread carries it until the scope ends.
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace cordillera::server {

struct LogField {
  const char* name;
  std::variant<std::string, std::int64_t, double> value;
};
using LogFields = std::vector<LogField>;

/// level: debug, info, warn or error. format: text or json.
void start_log(const std::string& level, const std::string& format = "text");
void log_debug(const std::string& line, const LogFields& fields = {});
void log_info(const std::string& line, const LogFields& fields = {});
void log_warning(const std::string& line, const LogFields& fields = {});
/// Whether log_debug says anything: for lines that are costly to make.
bool logs_debug();

class LogScope {
 public:
  LogScope(const char* name, std::string value);
  ~LogScope();
  LogScope(const LogScope&) = delete;
  LogScope& operator=(const LogScope&) = delete;
};

/// UTC with milliseconds, RFC 3339.
std::string now_text();

/// What users sent, as UTF-8 and without the characters that would start a line of their own or steer a terminal.
std::string printable(std::string_view text);

}  // namespace cordillera::server
