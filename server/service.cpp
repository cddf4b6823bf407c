#include "server/service.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "server/log.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

/// A descriptor that holds the lock, or -1.
int lock_file(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644);
  if (descriptor >= 0 && flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  if (descriptor >= 0) close(descriptor);
  return -1;
}

/// A folder with somebody else's files must not become ours: what no dataset owns is removed from it.
bool is_ours(const Layout& layout) {
  std::error_code error;
  if (fs::exists(layout.registry(), error)) return true;
  for (const auto& entry : fs::directory_iterator(layout.root, error)) {
    const bool started = entry.path() == layout.lock() || entry.path() == layout.incoming() || entry.path() == layout.datasets();
    if (!started || (entry.is_directory(error) && !fs::is_empty(entry.path(), error))) return false;
  }
  return true;
}

proto::Result<std::unique_ptr<access::Gate>> open_gate(const Settings& settings) {
  const ServeSettings& serve = settings.serve;
  auto gate = access::Gate::open({serve.listen, serve.tokens, serve.token_lines, serve.insecure_writes});
  if (!gate || !settings.private_dataset || (*gate)->has_tokens()) return gate;
  return proto::Problem{"options-conflict", "--private without tokens would keep nobody out", "--tokens FILE beside it", "--private"};
}

/// Folders of datasets that the registry does not know: an upload or a delete was cut off.
void remove_orphans(const Layout& layout, const Registry& registry) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(layout.datasets(), error)) {
    const std::string id = entry.path().filename().string();
    if (registry.find(id)) continue;
    log_info("removing " + id + ", which no dataset owns");
    std::error_code ignored;
    fs::remove_all(entry.path(), ignored);
  }
}

/// What a process that was killed had no time to remove: rasters of finished builds, folders of failed ones.
void remove_remains(const Layout& layout, const Registry& registry, updates::Ledger& ledger, std::size_t keep) {
  for (const Dataset& dataset : registry.list()) {
    std::error_code ignored;
    const fs::path folder = layout.dataset(dataset.id);
    if (dataset.state == State::failed) fs::remove_all(folder, ignored);
    if (ledger.holds(dataset.id)) ledger.tidy(dataset.id, keep);
    else if (dataset.state == State::ready) keep_store_alone(folder);
  }
}

}  // namespace

Service::Service(const Settings& settings, int lock)
    : settings_(settings), layout_{settings.serve.data}, lock_(lock), mounts_(settings), library_(layout_, metrics_, mounts_), uploads_(layout_.uploads()), ledger_(layout_),
      archive_(layout_) {}

proto::Result<std::unique_ptr<Service>> Service::open(const Settings& settings, JobRunner runner) {
  const Layout layout{settings.serve.data};
  const auto unusable = [&](const std::string& why) {
    return proto::Problem{"data-unusable", "cannot use the data folder " + layout.root.string() + ": " + why,
                          "a folder of its own that can be written: a new one, an empty one or that of an earlier server", "--data"};
  };
  auto gate = open_gate(settings);
  if (!gate) return gate.problem();
  std::error_code error;
  fs::create_directories(layout.root, error);
  if (error) return unusable(error.message());
  if (!is_ours(layout)) return unusable("it holds other things");
  const int lock = lock_file(layout.lock());
  if (lock < 0) return unusable("another server uses it, or it cannot be written");
  std::unique_ptr<Service> service(new Service(settings, lock));

  fs::remove_all(layout.incoming(), error);
  fs::create_directories(layout.incoming(), error);
  if (!error) fs::create_directories(layout.datasets(), error);
  if (error) return unusable(error.message());
  auto registry = Registry::open(layout.registry().string());
  if (!registry) return registry.problem();
  service->registry_ = std::move(registry.value());
  try {
    remove_orphans(layout, *service->registry_);
    remove_remains(layout, *service->registry_, service->ledger_, settings.serve.keep_versions);
    service->uploads_.remove_old();
  } catch (const RegistryError& broken) {
    return unusable(broken.what());
  }
  for (const Dataset& mounted : service->mounts_.list()) {
    if (!service->registry_->find(mounted.id)) continue;
    return proto::Problem{"options-conflict", "a dataset that was posted is called " + mounted.id + " already", "another name", "--mount"};
  }
  service->gate_ = std::move(*gate);
  service->audit_ = std::make_unique<access::Audit>(settings.serve.audit_log.empty() ? layout.audit() : fs::path(settings.serve.audit_log));
  service->admission_ = std::make_unique<limits::Admission>(settings.serve.limits, layout.root, *service->registry_);
  const auto published = [self = service.get()](const std::string& id) {
    self->library_.forget(id);
    self->archive_.forget(id);
  };
  service->queue_ = std::make_unique<JobQueue>(
      JobQueue::Parts{layout, *service->registry_, service->hub_, service->metrics_, std::move(runner), settings.serve.limits, service->ledger_,
                      updates::fetcher(settings.serve, service->admission_->space()), settings.serve.keep_versions, published},
      settings.serve.jobs);
  service->queue_->resume();
  return service;
}

Service::~Service() {
  stop();
  queue_.reset();
  close(lock_);
}

void Service::stop() {
  hub_.close();
  if (queue_) queue_->stop();
}

std::optional<Dataset> Service::find(const std::string& id) const {
  auto mounted = mounts_.find(id);
  return mounted ? mounted : registry_->find(id);
}

std::vector<Dataset> Service::list() const {
  std::vector<Dataset> all = mounts_.list(), posted = registry_->list();
  all.insert(all.end(), std::make_move_iterator(posted.begin()), std::make_move_iterator(posted.end()));
  return all;
}

Token Service::wait_token() {
  const std::lock_guard lock(mutex_);
  if (waiting_ >= kMostWaiting) return nullptr;
  ++waiting_;
  return Token(this, [](void* service) {
    auto* self = static_cast<Service*>(service);
    const std::lock_guard inner(self->mutex_);
    --self->waiting_;
  });
}

int Service::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_;
}

Token Service::key_token(const std::string& idempotency_key) {
  const std::lock_guard lock(mutex_);
  if (!keys_.insert(idempotency_key).second) return nullptr;
  return Token(this, [idempotency_key](void* service) {
    auto* self = static_cast<Service*>(service);
    const std::lock_guard inner(self->mutex_);
    self->keys_.erase(idempotency_key);
  });
}

}  // namespace cordillera::server
