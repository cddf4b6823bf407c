#include "server/datasets/registry.h"

#include <algorithm>
#include <functional>
#include <map>
#include <shared_mutex>
#include <unordered_map>

#include "pipeline/store/sqlite.h"
#include "server/datasets/ledger.h"
#include "server/datasets/registry_file.h"
#include "server/http/dataset_id.h"

namespace cordillera::server {
namespace {

/// The rows of a file that nobody else writes, in memory. They change when the file has.
class KeptRegistry : public Registry {
 public:
  explicit KeptRegistry(std::unique_ptr<RegistryFile> file) : file_(std::move(file)) {
    for (const Row& row : file_->list()) put(row->id, row);
  }

  bool add(const Dataset& dataset) override {
    const std::lock_guard writing(writing_);
    Dataset added = dataset;
    try {
      added.number = file_->insert(dataset);
    } catch (const RegistryError& error) {
      if (refresh(dataset.id)) throw;
      throw RegistryInDoubt(error.what());
    }
    if (added.number == 0) return false;
    put(dataset.id, std::make_shared<const Dataset>(std::move(added)));
    return true;
  }

  Row find(const std::string& id) const override {
    const std::shared_lock lock(mutex_);
    const auto found = by_id_.find(id);
    return found == by_id_.end() ? nullptr : found->second;
  }
  bool holds(const std::string& id) const override { return find(id) || file_->holds(id); }
  Row find_by_key(const std::string& owner, const std::string& key) const override {
    const std::shared_lock lock(mutex_);
    const auto found = by_key_.find({owner, key});
    return found == by_key_.end() ? nullptr : found->second;
  }
  std::vector<Row> below(std::int64_t number, std::size_t most) const override {
    const std::shared_lock lock(mutex_);
    std::vector<Row> some;
    for (auto at = by_number_.upper_bound(number); at != by_number_.end() && some.size() < most; ++at) some.push_back(at->second);
    return some;
  }
  StateCounts counts() const override {
    const std::shared_lock lock(mutex_);
    return counts_;
  }

  void set_state(const std::string& id, State state, const std::optional<proto::Problem>& problem) override {
    change(
        id, [&] { file_->set_state(id, state, problem); },
        [&](Dataset& dataset) {
          dataset.state = state;
          dataset.problem = problem;
        });
  }
  void describe(const std::string& id, const proto::BuildOptions& options, bool is_private) override {
    change(
        id, [&] { file_->describe(id, options, is_private); },
        [&](Dataset& dataset) {
          dataset.options = options;
          dataset.is_private = is_private;
        });
  }
  void remove(const std::string& id) override {
    write(
        id, [&] { file_->remove(id); }, [](const Row&) { return nullptr; });
  }
  bool remove_failed(const std::string& id) override {
    bool removed = false;
    write(
        id, [&] { removed = file_->remove_failed(id); }, [&](const Row& row) { return removed ? nullptr : row; });
    return removed;
  }
  void compact() override {
    const std::lock_guard writing(writing_);
    file_->compact();
  }

 private:
  void change(const std::string& id, const std::function<void()>& in_file, const std::function<void(Dataset&)>& edit) {
    write(id, in_file, [&](const Row& row) -> Row {
      if (!row) return nullptr;
      auto changed = std::make_shared<Dataset>(*row);
      edit(*changed);
      return changed;
    });
  }
  /// First the file, then what is read.
  void write(const std::string& id, const std::function<void()>& in_file, const std::function<Row(Row)>& after) {
    const std::lock_guard writing(writing_);
    try {
      in_file();
    } catch (const RegistryError&) {
      refresh(id);
      throw;
    }
    put(id, after(find(id)));
  }

  /// After a write that failed, which may have happened all the same. False: the row is in the file, or that cannot be known.
  bool refresh(const std::string& id) {
    try {
      Row row = file_->find(id);
      const bool absent = row == nullptr;
      put(id, std::move(row));
      return absent;
    } catch (const RegistryError&) { return false; }
  }

  void put(const std::string& id, Row row) {
    const std::lock_guard lock(mutex_);
    if (const auto old = by_id_.find(id); old != by_id_.end()) {
      by_number_.erase(old->second->number);
      by_key_.erase({old->second->owner, old->second->idempotency_key});
      --count_of(old->second->state);
      by_id_.erase(old);
    }
    if (!row) return;
    by_number_[row->number] = row;
    if (!row->idempotency_key.empty()) by_key_[{row->owner, row->idempotency_key}] = row;
    ++count_of(row->state);
    by_id_[id] = std::move(row);
  }
  std::size_t& count_of(State state) {
    return state == State::queued    ? counts_.queued
           : state == State::running ? counts_.running
           : state == State::ready   ? counts_.ready
                                     : counts_.failed;
  }

  const std::unique_ptr<RegistryFile> file_;
  std::mutex writing_;               ///< one write after the other; held over the disk's time
  mutable std::shared_mutex mutex_;  ///< of what follows; held for a look alone
  std::unordered_map<std::string, Row> by_id_;
  std::map<std::int64_t, Row, std::greater<>> by_number_;
  std::map<std::pair<std::string, std::string>, Row> by_key_;  ///< owner and idempotency key
  StateCounts counts_;
};

}  // namespace

bool stays_in_its_folder(const Dataset& dataset) { return is_id(dataset.id) && updates::may_be_raster(dataset.raster); }

std::string to_string(State state) {
  switch (state) {
    case State::queued: return "queued";
    case State::running: return "running";
    case State::ready: return "ready";
    case State::failed: break;
  }
  return "failed";
}

std::size_t count_private(const Registry& registry) {
  return static_cast<std::size_t>(std::ranges::count_if(registry.list(), [](const Row& row) { return row->is_private; }));
}

proto::Result<std::unique_ptr<Registry>> Registry::open(const std::string& path) {
  auto file = RegistryFile::open(path);
  if (!file) return file.problem();
  try {
    return std::unique_ptr<Registry>(std::make_unique<KeptRegistry>(std::move(*file)));
  } catch (const RegistryError& error) {
    return proto::Problem{"data-unusable", path + ": " + error.what(), "the registry of a backup, with cordillera restore",
                          "--data"};
  }
}

std::unique_ptr<Registry> Registry::read_only(const std::string& path) { return RegistryFile::read_only(path); }

std::optional<proto::Problem> Registry::refused(const std::string& path) { return RegistryFile::refused(path); }

void Registry::copy(const std::string& from, const std::string& to) {
  try {
    pipeline::Database(from, RegistryFile::to_read(from)).copy_to(to);
  } catch (const pipeline::StoreError& error) { throw RegistryError("cannot copy " + from + ": " + error.what()); }
}

}  // namespace cordillera::server
