#pragma once
// Which datasets there are and how far they got: one SQLite file, data/registry.sqlite. A dataset gets its row when its raster is
// wholly on disk, so nothing half-made can be listed.
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
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
  std::string owner;         ///< name of the token that posted it; empty: none was shown
  bool is_private = false;   ///< read with a token only
  std::string request_id;    ///< of the request that posted it
};

/// Datasets in each state.
struct StateCounts {
  std::size_t queued = 0, running = 0, ready = 0, failed = 0;
};

/// The registry's file cannot be read or written: disk full, read-only, damaged. What was asked for did not happen.
class RegistryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Version of the data folder, in the registry. Earlier ones are brought up to it, later ones refused.
inline constexpr int kDataVersion = 1;

/// Thread-safe. All but open() throw RegistryError; a row that is not found is another matter.
class Registry {
 public:
  static proto::Result<std::unique_ptr<Registry>> open(const std::string& path);
  /// Of a folder that a server may be using. Changes nothing.
  static std::unique_ptr<Registry> read_only(const std::string& path);
  /// The file as it stands, into a new one, while a server may be using it.
  static void copy(const std::string& from, const std::string& to);
  virtual ~Registry() = default;
  /// False if the id or the idempotency key is taken.
  virtual bool add(const Dataset& dataset) = 0;
  virtual std::optional<Dataset> find(const std::string& id) const = 0;
  virtual std::optional<Dataset> find_by_key(const std::string& idempotency_key) const = 0;
  /// Newest first.
  virtual std::vector<Dataset> list() const = 0;
  virtual StateCounts counts() const = 0;
  virtual void set_state(const std::string& id, State state, const std::optional<proto::Problem>& problem) = 0;
  virtual void remove(const std::string& id) = 0;
  /// Folds the log in and gives free pages back.
  virtual void compact() = 0;
};

}  // namespace cordillera::server
