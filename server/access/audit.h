#pragma once
// Who wrote what: a JSON line for every request that was let write, whatever became of it.
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>

#include "proto/result.h"

namespace cordillera::server::access {

struct AuditEntry {
  std::string who;  ///< name of the token; empty: without tokens everybody may
  std::string client;
  std::string method;
  std::string path;
  std::string dataset;      ///< empty: none came of it
  std::uint64_t bytes = 0;  ///< of the body
  int status = 0;
  std::string problem;  ///< slug; empty: it went well
  std::string request_id;
};

/// Why no line could be written into a file of that name. Nothing is left behind.
std::optional<proto::Problem> refuse_audit_log(const std::filesystem::path& file);

/// Thread-safe. The file is opened for each line, so that it can be moved away at any time.
class Audit {
 public:
  explicit Audit(std::filesystem::path file) : file_(std::move(file)) {}
  void note(const AuditEntry& entry);

 private:
  std::filesystem::path file_;
  std::mutex mutex_;
};

}  // namespace cordillera::server::access
