#pragma once
// Which datasets there are and how far they got: one SQLite file, data/registry.sqlite. A dataset gets its row when its raster is
// wholly on disk, so nothing half-made can be listed.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cordillera.pb.h"
#include "proto/result.h"

namespace cordillera::server {

enum class State { queued, running, ready, failed };
std::string to_string(State state);

struct Dataset {
  std::string id;
  std::string name;
  State state = State::queued;
  proto::BuildOptions options;
  std::optional<proto::Problem> problem;  ///< why it failed
  std::string created;                    ///< UTC, RFC 3339
  std::string raster;                     ///< file name in the dataset's folder
  std::string idempotency_key;            ///< empty: none was given
  std::string options_hash;               ///< of everything in the request but the body
  std::string body_hash;
};

/// Thread-safe.
class Registry {
 public:
  static proto::Result<std::unique_ptr<Registry>> open(const std::string& path);
  virtual ~Registry() = default;
  /// False if the id or the idempotency key is taken.
  virtual bool add(const Dataset& dataset) = 0;
  virtual std::optional<Dataset> find(const std::string& id) const = 0;
  virtual std::optional<Dataset> find_by_key(const std::string& idempotency_key) const = 0;
  /// Newest first.
  virtual std::vector<Dataset> list() const = 0;
  virtual void set_state(const std::string& id, State state, const std::optional<proto::Problem>& problem) = 0;
  virtual void remove(const std::string& id) = 0;
};

}  // namespace cordillera::server
