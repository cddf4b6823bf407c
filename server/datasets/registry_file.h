#pragma once
// The registry's SQLite file: each call reads or writes it.
#include <mutex>
#include <optional>

#include "pipeline/store/sqlite.h"
#include "server/datasets/registry.h"

namespace cordillera::server {

class RegistryFile : public Registry {
 public:
  /// Brings the tables to this version, all of it or nothing.
  static proto::Result<std::unique_ptr<RegistryFile>> open(const std::string& path);
  static std::unique_ptr<RegistryFile> read_only(const std::string& path);
  /// How the file is opened to be read, by whoever may write it or not.
  static pipeline::Database::Mode to_read(const std::string& path);
  /// Why a server of this version would not start on it. Changes nothing.
  static std::optional<proto::Problem> refused(const std::string& path);
  /// Why a file is no registry, of whatever version; empty: it is one, or there is no room on its disk to look.
  static std::string why_not_ours(const std::string& path);

  bool add(const Dataset& dataset) override { return insert(dataset) != 0; }
  /// The number that the row got; 0: what must be unique is taken.
  std::int64_t insert(const Dataset& dataset);
  Row find(const std::string& id) const override;
  bool holds(const std::string& id) const override;
  Row find_by_key(const std::string& owner, const std::string& key) const override;
  std::vector<Row> below(std::int64_t number, std::size_t most) const override;
  StateCounts counts() const override;
  void set_state(const std::string& id, State state, const std::optional<proto::Problem>& problem) override;
  void describe(const std::string& id, const proto::BuildOptions& options, bool is_private) override;
  void remove(const std::string& id) override;
  bool remove_failed(const std::string& id) override;
  void compact() override;

 private:
  RegistryFile(const std::string& path, pipeline::Database::Mode mode) : database_(path, mode) {}
  Row find_where(const std::string& column, const std::string& value) const;
  void checkpoint();

  mutable std::mutex mutex_;
  mutable pipeline::Database database_;
};

}  // namespace cordillera::server
