#include "server/service/service.h"

#include <sys/resource.h>
#include <unistd.h>

#include "server/data/folder_lock.h"
#include "server/datasets/adoption.h"
#include "server/datasets/dataset_folder.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kReadAhead = 256;  // rows at a time

proto::Result<std::unique_ptr<access::Gate>> open_gate(const Settings& settings) {
  const ServeSettings& serve = settings.serve;
  auto gate = access::Gate::open({serve.listen, serve.tokens, serve.token_lines, serve.insecure_writes});
  if (!gate || !settings.private_dataset || (*gate)->has_tokens()) return gate;
  return proto::Problem{"options-conflict", "--private without tokens would keep nobody out", "--tokens FILE beside it",
                        "--private"};
}

/// They were posted while there were tokens; who left those out may not know.
void warn_of_private(const access::Gate& gate, const Registry& registry) {
  const std::size_t hidden = gate.has_tokens() ? 0 : count_private(registry);
  if (hidden > 0)
    log_warning("there are no tokens: only this machine reads what is private (" + std::to_string(hidden) +
                (hidden == 1 ? " dataset)" : " datasets)") + "; --tokens FILE lets others read it");
}

/// What a process that was killed had no time to do: deletions, states, records; rasters of finished builds and folders of failed
/// ones to be removed.
void put_in_order(const Layout& layout, Registry& registry, updates::Ledger& ledger, std::size_t keep) {
  for (const Row& row : registry.list()) {
    const fs::path folder = layout.dataset(row->id);
    const bool deleted = is_marked_deleted(folder);
    if (deleted) registry.remove(row->id);
    const bool built = row->state == State::ready || (!deleted && is_built(layout, *row));
    if (built && row->state != State::ready) {
      log_warning("dataset " + row->id + " is built, though the registry says " + to_string(row->state) + ": it is served");
      registry.set_state(row->id, State::ready, std::nullopt);
    }
    if (deleted || (!built && row->state == State::failed)) {
      remove_dataset_folder(layout, row->id);
      continue;
    }
    if (ledger.holds(row->id))
      ledger.tidy(row->id, keep);
    else if (built)
      keep_store_alone(folder);
    std::error_code error;
    if (!fs::exists(folder, error)) continue;
    if (!fs::exists(folder / kRecordFile, error)) {
      if (!write_record(folder, *row)) log_warning("dataset " + row->id + ": " + kRecordFile + " cannot be written");
      continue;
    }
    // The record is written first. What the registry has lost since then may not open a dataset to everybody.
    const auto record = read_record(folder);
    if (!record || !record->is_private || row->is_private) continue;
    log_warning("dataset " + row->id + " is private, though the registry says otherwise");
    registry.describe(row->id, row->options, true);
  }
}

}  // namespace

Service::Service(const Settings& settings, std::unique_ptr<FolderLock> lock)
    : settings_(settings),
      layout_{settings.serve.data},
      lock_(std::move(lock)),
      mounts_(settings),
      library_(layout_, metrics_, mounts_, {.open = settings.serve.limits.open_datasets}),
      uploads_(layout_.uploads()),
      ledger_(layout_),
      archive_(layout_) {}

proto::Result<std::unique_ptr<Service>> Service::open(const Settings& settings, JobRunner runner) {
  const Layout layout{settings.serve.data};
  const auto unusable = [&](const std::string& why) {
    return proto::Problem{"data-unusable", "cannot use the data folder " + layout.root.string() + ": " + why,
                          "a folder of its own that can be written: a new one, an empty one or that of an earlier server",
                          "--data"};
  };
  auto gate = open_gate(settings);
  if (!gate) return gate.problem();
  if (auto refused = refuse_mounts(settings.serve.mounts)) return *refused;
  std::error_code error;
  fs::create_directories(layout.root, error);
  if (error) return unusable(error.message());
  if (const auto other = others_file(layout); other && !fs::exists(layout.lock(), error))
    return unusable("it holds other things: " + *other);
  auto lock = std::make_unique<FolderLock>(layout);
  if (!lock->held()) return unusable(lock->why_not("another server"));
  std::unique_ptr<Service> service(new Service(settings, std::move(lock)));
  if (auto lost = lost_registry(layout)) return *lost;
  if (const auto other = others_file(layout)) return unusable("it holds other things: " + *other);

  fs::remove_all(layout.removed(), error);
  fs::remove_all(layout.incoming(), error);
  fs::create_directories(layout.incoming(), error);
  if (!error) fs::create_directories(layout.datasets(), error);
  if (error) return unusable(error.message());
  auto registry = Registry::open(layout.registry().string());
  if (!registry) return registry.problem();
  service->registry_ = std::move(registry.value());
  service->library_.set_existence_check([&registry = *service->registry_, &mounts = service->mounts_](const std::string& id) {
    return mounts.has(id) || registry.find(id);
  });
  service->library_.set_words([&registry = *service->registry_](const std::string& id) {
    const Row row = registry.find(id);
    return row ? words_of(row->options) : pipeline::Words();
  });
  try {
    adopt_folders(layout, *service->registry_);
    put_in_order(layout, *service->registry_, service->ledger_, settings.serve.keep_versions);
    service->uploads_.remove_old();
    warn_of_private(**gate, *service->registry_);
  } catch (const RegistryError& broken) { return unusable(broken.what()); }
  for (const Row& mounted : service->mounts_.list()) {
    if (!service->registry_->find(mounted->id)) continue;
    return proto::Problem{"options-conflict", "a dataset that was posted is called " + mounted->id + " already", "another name",
                          "--mount"};
  }
  service->gate_ = std::move(*gate);
  const fs::path audit = settings.serve.audit_log.empty() ? layout.audit() : fs::path(settings.serve.audit_log);
  if (auto refused = access::refuse_audit_log(audit)) return *refused;
  service->audit_ = std::make_unique<access::Audit>(audit);
  service->begin_work(std::move(runner));
  return service;
}

void Service::begin_work(JobRunner runner) {
  const ServeSettings& serve = settings_.serve;
  admission_ = std::make_unique<limits::Admission>(serve.limits, layout_.root, *registry_);
  const auto published = [this](const std::string& id) {
    forget(id);
    if (LiveCache* const live = told_) live->touch();
  };
  archive_files_ = std::make_unique<ArchiveFiles>(
      layout_.archives(), admission_->space(), [this](const std::string& id) { hub_.touch(id); }, serve.limits.open_archives);
  admission_->space().set_spare([this](std::uint64_t bytes) { return archive_files_->spare(bytes); });
  queue_ =
      std::make_unique<JobQueue>(JobQueue::Parts{layout_, *registry_, hub_, metrics_, std::move(runner), serve.limits, ledger_,
                                                 updates::fetcher(serve, admission_->space()), serve.keep_versions, published},
                                 serve.jobs);
  live_ = std::make_unique<LiveCache>(LiveCache::Parts{
      layout_, *registry_, *queue_, *admission_, metrics_, updates::asker(serve), std::uint64_t{serve.limits.cache_mib} << 20,
      serve.limits.queue, [this, published](const std::string& id) { published(id), hub_.ended(id); },  // how far it was, too
      std::chrono::seconds(serve.live_fresh_seconds)});
  told_ = live_.get();
  queue_->resume();
  reading_ahead_ = std::thread([this] { read_ahead(); });
}

Service::~Service() {
  stop();
  if (reading_ahead_.joinable()) reading_ahead_.join();
  live_.reset();  // it uses the queue, whose threads have ended
  queue_.reset();
  if (admission_) admission_->space().set_spare(nullptr);
  archive_files_.reset();
}

void Service::stop() {
  hub_.close();
  if (queue_) queue_->stop();
}

Row Service::find(const std::string& id) const {
  const Row mounted = mounts_.find(id);
  return mounted ? mounted : registry_->find(id);
}

void Service::forget(const std::string& id) {
  library_.forget(id);
  archive_.forget(id);
  archive_files_->forget(id);
  list_texts_.forget(id);
}

/// What lists show of each dataset, so that the first one who searches does not wait for the disk.
void Service::read_ahead() {
  setpriority(PRIO_PROCESS, 0, 10);  // of this thread alone: those who ask now go first
  std::int64_t after = kBeforeAll;
  for (auto rows = registry_->below(after, kReadAhead); !rows.empty(); rows = registry_->below(after, kReadAhead)) {
    for (const Row& row : rows) {
      if (stopping()) return;
      after = row->number;
      if (row->state == State::ready) (void)library_.summary(row->id);
    }
  }
}

Token Service::wait_token(WaitsFor what) {
  const auto which = static_cast<std::size_t>(what);
  const std::lock_guard lock(mutex_);
  if (waiting_[which] >= (what == WaitsFor::tiles ? kMostWaitingForTiles : kMostWaiting)) return nullptr;
  ++waiting_[which];
  return Token(this, [which](void* service) {
    auto* self = static_cast<Service*>(service);
    const std::lock_guard inner(self->mutex_);
    --self->waiting_[which];
  });
}

int Service::waiting(WaitsFor what) const {
  const std::lock_guard lock(mutex_);
  return waiting_[static_cast<std::size_t>(what)];
}

Token Service::key_token(const std::string& owner, const std::string& idempotency_key) {
  const std::lock_guard lock(mutex_);
  if (!keys_.insert({owner, idempotency_key}).second) return nullptr;
  return Token(this, [key = std::pair(owner, idempotency_key)](void* service) {
    auto* self = static_cast<Service*>(service);
    const std::lock_guard inner(self->mutex_);
    self->keys_.erase(key);
  });
}

}  // namespace cordillera::server
