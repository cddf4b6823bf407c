#include "server/service/readiness.h"

#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include "raster/disk/descriptor.h"

namespace cordillera::server {
namespace {

/// What asking for permissions would not find: a disk that went read-only, or one without room for a name.
std::string cannot_write(const std::filesystem::path& folder) {
  const std::string probe = (folder / (".probe-" + std::to_string(getpid()))).string();
  const raster::Descriptor file(::open(probe.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
  const bool written = file.is_open() && ::write(file.number(), "x", 1) == 1;
  const std::string why = written ? "" : strerror(errno);
  ::unlink(probe.c_str());
  return why;
}

}  // namespace

std::vector<Reason> why_not_ready(Service& service) {
  if (service.stopping()) return {Reason{"stopping", "the service is stopping"}};
  std::vector<Reason> reasons;
  const Limits& limits = service.settings().serve.limits;
  const limits::InUse now = service.admission().in_use();
  if (const std::string full = service.admission().space().full(0); !full.empty()) reasons.push_back(Reason{"disk-full", full});
  if (const std::string why = cannot_write(service.layout().incoming()); !why.empty())
    reasons.push_back(Reason{"data-not-writable", "the data folder cannot be written: " + why});
  if (now.queue >= limits.queue)
    reasons.push_back(Reason{"queue-full", std::to_string(now.queue) + " builds wait, as many as may"});
  if (now.datasets >= limits.datasets)
    reasons.push_back(Reason{"datasets-full", std::to_string(now.datasets) + " datasets, as many as may be kept"});
  return reasons;
}

}  // namespace cordillera::server
