#include "server/access/audit.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>

#include "raster/disk/descriptor.h"
#include "server/http/json.h"
#include "server/log/log.h"

namespace cordillera::server::access {

std::optional<proto::Problem> refuse_audit_log(const std::filesystem::path& file) {
  std::error_code error;
  const bool there = std::filesystem::exists(file, error), is_folder = std::filesystem::is_directory(file, error);
  const std::filesystem::path folder = std::filesystem::absolute(file, error).parent_path();
  const int asked = there ? ::access(file.c_str(), W_OK) : ::access(folder.c_str(), W_OK | X_OK);
  const std::string why = is_folder ? "it is a folder" : asked != 0 ? strerror(errno) : "";
  if (why.empty()) return std::nullopt;
  return proto::Problem{"option-invalid", "the audit log " + file.string() + " cannot be written: " + why,
                        "a file in a folder that can be written", "--audit-log"};
}

namespace {

/// Cuts half a line off, or the next one would be glued to it. Where another process has written behind it, nothing is cut off.
void take_back(int file, ssize_t bytes) {
  const off_t end = ::lseek(file, 0, SEEK_CUR);
  struct stat now {};
  if (end >= bytes && ::fstat(file, &now) == 0 && now.st_size == end && ::ftruncate(file, end - bytes) == 0) return;
  log_warning("the audit log has half a line");
}

}  // namespace

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
  const raster::Descriptor file(::open(file_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0640));
  // One write: lines of two processes do not mix.
  const ssize_t bytes = !file.is_open() ? -1 : ::write(file.number(), line.data(), line.size());
  const bool written = bytes == static_cast<ssize_t>(line.size());
  if (!written)
    log_warning("the audit log cannot be written: " + std::string(bytes < 0 ? strerror(errno) : "the disk is full"),
                {{"line", line}});
  if (bytes > 0 && !written) take_back(file.number(), bytes);
}

}  // namespace cordillera::server::access
