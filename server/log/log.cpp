#include "server/log/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <ctime>

#include "proto/utf8.h"
#include "server/http/json.h"

namespace cordillera::server {
namespace {

enum class LogFormat { text, json };
LogFormat g_format = LogFormat::text;  // set before the first thread starts
thread_local LogFields t_scopes;

Json value_of(const LogField& field) {
  return std::visit([](const auto& value) { return Json(value); }, field.value);
}

std::string json_line(const char* level, const std::string& line, const LogFields& fields) {
  Json json;
  json["time"] = now_text();
  json["level"] = level;
  json["message"] = line;
  for (const LogFields* some : {static_cast<const LogFields*>(&t_scopes), &fields}) {
    for (const LogField& field : *some) json[field.name] = value_of(field);
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// In quotes where it would else be taken for several, with fields of their own.
std::string one_word(const std::string& text) {
  if (text.find_first_of(" \t\r\n\"") == text.npos) return text;
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string text_line(const std::string& line, const LogFields& fields) {
  std::string text = line;
  for (const LogFields* some : {static_cast<const LogFields*>(&t_scopes), &fields}) {
    for (const LogField& field : *some) {
      const auto* word = std::get_if<std::string>(&field.value);
      text.append(" ").append(field.name).append("=").append(word != nullptr ? one_word(*word) : value_of(field).dump());
    }
  }
  return printable(text);
}

void say(spdlog::level::level_enum level, const char* name, const std::string& line, const LogFields& fields) {
  if (!spdlog::should_log(level)) return;
  // The line is an argument, not the format: it holds what users sent.
  spdlog::log(level, "{}", g_format == LogFormat::json ? json_line(name, line, fields) : text_line(line, fields));
}

}  // namespace

std::string now_text() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const std::time_t seconds = std::chrono::duration_cast<std::chrono::seconds>(now).count();
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[40];
  const auto length = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count() % 1000;
  std::snprintf(text + length, sizeof text - length, ".%03dZ", static_cast<int>(ms));
  return text;
}

void start_log(const std::string& level, const std::string& format) {
  static const auto logger = spdlog::stderr_color_mt("cordillera");
  g_format = format == "json" ? LogFormat::json : LogFormat::text;
  spdlog::set_default_logger(logger);
  spdlog::set_pattern(g_format == LogFormat::json ? "%v" : "%Y-%m-%dT%H:%M:%S.%e %^%l%$ %v");
  spdlog::set_level(spdlog::level::from_str(level == "error" ? "err" : level));
}

void log_debug(const std::string& line, const LogFields& fields) { say(spdlog::level::debug, "debug", line, fields); }
void log_info(const std::string& line, const LogFields& fields) { say(spdlog::level::info, "info", line, fields); }
void log_warning(const std::string& line, const LogFields& fields) { say(spdlog::level::warn, "warning", line, fields); }
bool logs_debug() { return spdlog::should_log(spdlog::level::debug); }

LogScope::LogScope(const char* name, std::string value) { t_scopes.push_back({name, std::move(value)}); }
LogScope::~LogScope() { t_scopes.pop_back(); }

std::string printable(std::string_view text) { return proto::without_control(proto::as_utf8(text), '?'); }

}  // namespace cordillera::server
