#include "server/access/audit.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstring>

#include "server/http/json.h"
#include "server/log/log.h"

namespace cordillera::server::access {

std::optional<proto::Problem> refuse_audit_log(const std::filesystem::path& file) {
  std::error_code error;
  const bool there = std::filesystem::exists(file, error);
  const std::filesystem::path folder = std::filesystem::absolute(file, error).parent_path();
  const char* const written = there ? file.c_str() : folder.c_str();
  if (!std::filesystem::is_directory(file, error) && ::access(written, there ? W_OK : W_OK | X_OK) == 0) return std::nullopt;
  const std::string why = std::filesystem::is_directory(file, error) ? "it is a folder" : strerror(errno);
  return proto::Problem{"option-invalid", "the audit log " + file.string() + " cannot be written: " + why,
                        "a file in a folder that can be written", "--audit-log"};
}

void Audit::note(const AuditEntry& entry) {
  Json json;
  json["time"] = now_text();
  json["who"] = entry.who.empty() ? Json(nullptr) : Json(entry.who);
  json["client"] = entry.client;
  json["method"] = entry.method;
  json["path"] = entry.path.substr(0, 300);
  json["dataset"] = entry.dataset.empty() ? Json(nullptr) : Json(entry.dataset);
  json["bytes"] = entry.bytes;
  json["status"] = entry.status;
  if (!entry.problem.empty()) json["problem"] = entry.problem;
  json["request"] = entry.request_id;
  const std::string line = json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  const std::lock_guard lock(mutex_);
  const int file = ::open(file_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0640);
  // One write: lines of two processes do not mix.
  const bool written = file >= 0 && ::write(file, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  if (!written) log_warning("the audit log cannot be written: " + std::string(strerror(errno)), {{"line", line}});
  if (file >= 0) ::close(file);
}

}  // namespace cordillera::server::access
