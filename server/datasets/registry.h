#pragma once
// Which datasets there are and how far they got: one SQLite file, data/registry.sqlite. A dataset gets its row when its raster is
// wholly on disk, so nothing half-made can be listed.
#include <cstdint>
#include <limits>
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
  std::int64_t number = 0;  ///< given by the registry; a later dataset has a greater one
  std::string id;
  std::string name;
  State state = State::queued;
  proto::BuildOptions options;
  std::optional<proto::Problem> problem;  ///< why it failed
  std::string created;                    ///< UTC, RFC 3339
  std::string raster;                     ///< file name in the dataset's folder
  std::string idempotency_key;            ///< empty: none was given
  std::string options_hash;               ///< of everything in the request but the body
  std::string body_hash;    ///< of the raster that was posted, or of the address; empty: nobody has posted it (/v1/live)
  std::string owner;        ///< name of the token that posted it; empty: none was shown
  bool is_private = false;  ///< read with a token only
  std::string request_id;   ///< of the request that posted it
  std::string address;      ///< that its raster is fetched from, and fetched again; empty: it was posted
  bool mounted = false;     ///< published elsewhere and only read here (mounts.h); the registry has none of these
};

/// Whether neither its id nor its raster names a place outside its folder.
bool stays_in_its_folder(const Dataset& dataset);

/// A row as it was at one moment; null: there is none.
using Row = std::shared_ptr<const Dataset>;

/// Datasets in each state.
struct StateCounts {
  std::size_t queued = 0, running = 0, ready = 0, failed = 0;
};

/// The registry's file cannot be read or written: disk full, read-only, damaged. What was asked for did not happen.
class RegistryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A row may be in the file although writing it failed.
class RegistryInDoubt : public RegistryError {
 public:
  using RegistryError::RegistryError;
};

/// Version of the data folder, in the registry. Earlier ones are brought up to it, later ones refused.
inline constexpr int kDataVersion = 1;

inline constexpr std::int64_t kBeforeAll = std::numeric_limits<std::int64_t>::max();

/// Thread-safe. What open() gives keeps all rows in memory: who reads waits neither for the disk nor for who writes. All but
/// open() throw RegistryError; a row that is not found is another matter. Rows that do not stay in their folder are left out, and
/// stay in the file.
class Registry {
 public:
  /// "data-version", "data-unusable": among others another program's database.
  static proto::Result<std::unique_ptr<Registry>> open(const std::string& path);
  /// For reading alone, while a server may be using the file.
  static std::unique_ptr<Registry> read_only(const std::string& path);
  /// The file as it stands, into a new one, while a server may be using it.
  static void copy(const std::string& from, const std::string& to);
  /// What open() would say of a file that is there; changes nothing.
  static std::optional<proto::Problem> refused(const std::string& path);
  virtual ~Registry() = default;
  /// False if the id, or the owner's idempotency key, is taken. True: the row is in the file itself, not in its log alone.
  virtual bool add(const Dataset& dataset) = 0;
  virtual Row find(const std::string& id) const = 0;
  /// Whether the file has a row of this id, one that is left out, too: its folder is nobody else's.
  virtual bool holds(const std::string& id) const = 0;
  virtual Row find_by_key(const std::string& owner, const std::string& idempotency_key) const = 0;
  /// At most `most`, newest first, of those with a number below.
  virtual std::vector<Row> below(std::int64_t number, std::size_t most) const = 0;
  std::vector<Row> list() const { return below(kBeforeAll, std::numeric_limits<std::int64_t>::max()); }
  virtual StateCounts counts() const = 0;
  virtual void set_state(const std::string& id, State state, const std::optional<proto::Problem>& problem) = 0;
  /// What may change of a dataset that is there: title and attribution in its options, and who may read it.
  virtual void describe(const std::string& id, const proto::BuildOptions& options, bool is_private) = 0;
  virtual void remove(const std::string& id) = 0;
  /// Look and removal are one step: a dataset that is built once more stays. False: it did, or there is none.
  virtual bool remove_failed(const std::string& id) = 0;
  /// Folds the log in and gives free pages back.
  virtual void compact() = 0;
};

/// Datasets that are read with a token only.
std::size_t count_private(const Registry& registry);

}  // namespace cordillera::server
