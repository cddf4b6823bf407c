// The disk, and who may write where.
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include <filesystem>

#include "raster/disk/descriptor.h"
#include "server/access/audit.h"
#include "server/api/documents/web.h"
#include "server/data/folder_lock.h"
#include "server/datasets/adoption.h"
#include "server/datasets/mounts.h"
#include "server/datasets/registry.h"
#include "server/doctor/doctor.h"
#include "server/limits/disk.h"
#include "server/live/live_notes.h"

namespace cordillera::server::doctor {
namespace {

namespace fs = std::filesystem;

/// The folder itself, or the first one above it that is there.
fs::path existing(fs::path folder) {
  std::error_code error;
  folder = fs::absolute(folder, error);
  while (!fs::exists(folder, error) && folder.has_parent_path() && folder != folder.parent_path()) folder = folder.parent_path();
  return folder;
}

std::string cannot_write(const fs::path& folder) {
  const std::string probe = (folder / (".cordillera-doctor-" + std::to_string(getpid()))).string();
  const raster::Descriptor file(::open(probe.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600));
  const bool written = file.is_open() && ::write(file.number(), "x", 1) == 1 && fsync(file.number()) == 0;
  const std::string why = written ? "" : strerror(errno);
  ::unlink(probe.c_str());
  return why;
}

std::string mib(std::uint64_t bytes) { return std::to_string(bytes >> 20) + " MiB"; }

Finding disk(const fs::path& folder, std::uint32_t free_percent) {
  const auto space = limits::disk_space(folder);
  if (!space)
    return Finding{"disk", Health::bad, "the disk of " + folder.string() + " cannot be asked", "--data with another folder"};
  const std::string what = mib(space->free) + " of " + mib(space->size) + " free";
  if (limits::room(*space, free_percent) > 0) return Finding{"disk", Health::good, what, ""};
  return Finding{"disk", Health::bad,
                 what + ", and " + std::to_string(free_percent) + " % are kept free: nothing could be posted",
                 "make room, name another disk with --data, or keep less free with --min-disk-free"};
}

Finding data_folder(const fs::path& data) {
  std::error_code error;
  const bool there = fs::exists(data, error);
  const fs::path at = existing(data);
  if (!fs::is_directory(at, error)) return Finding{"data", Health::bad, at.string() + " is no folder", "--data with a folder"};
  if (const std::string why = cannot_write(at); !why.empty()) {
    return Finding{"data", Health::bad, at.string() + " cannot be written: " + why,
                   "give it to the user that the service runs as: chown, or StateDirectory= of a systemd unit"};
  }
  if (!there) return Finding{"data", Health::good, data.string() + " is not there yet and can be made", ""};
  const Layout layout{data};
  const bool ours = fs::exists(layout.registry(), error);
  if (const auto other = others_file(layout); other && !fs::exists(layout.lock(), error))
    return Finding{"data", Health::bad, data.string() + " holds other things: " + *other,
                   "--data with a folder of its own: a new one, an empty one or that of an earlier server"};
  if (is_locked(layout))
    return Finding{"data", Health::bad, "another server uses " + data.string(), "stop it first, or --data with another folder"};
  auto refused = lost_registry(layout);
  if (!refused && ours) refused = Registry::refused(layout.registry().string());
  if (refused) return Finding{"data", Health::bad, refused->detail, refused->accepted};
  if (const fs::path incoming = layout.incoming(); fs::exists(incoming, error)) {
    if (const std::string why = cannot_write(incoming); !why.empty())
      return Finding{"data", Health::bad, incoming.string() + " cannot be written: " + why,
                     "give all of the folder to the user that the service runs as: chown -R"};
  }
  return Finding{"data", Health::good, data.string() + (ours ? " is a server's folder" : " can be written"), ""};
}

/// Bad where the service would not start with it.
Finding refusal_or(const char* name, const std::optional<proto::Problem>& refused, const std::string& good) {
  return refused ? Finding{name, Health::bad, refused->detail, refused->parameter + " with " + refused->accepted}
                 : Finding{name, Health::good, good, ""};
}

}  // namespace

void check_folders(const Settings& settings, Findings& findings) {
  findings.push_back(disk(existing(settings.serve.data), settings.serve.limits.free_percent));
  findings.push_back(data_folder(settings.serve.data));
  const ServeSettings& serve = settings.serve;
  if (!serve.mounts.empty())
    findings.push_back(refusal_or("mounts", refuse_mounts(serve.mounts), std::to_string(serve.mounts.size()) + " to be served"));
  if (!serve.live.empty()) {
    findings.push_back(refusal_or("live", refuse_live_folder(serve.live, serve.data), "rasters in " + serve.live));
    const auto notes = read_live_notes(Layout{serve.data}.live(), serve.live);
    if (!notes) findings.push_back(Finding{"live.json", Health::bad, notes.problem().detail, notes.problem().accepted});
  }
  if (!serve.audit_log.empty())
    findings.push_back(refusal_or("audit log", access::refuse_audit_log(serve.audit_log), serve.audit_log + " can be written"));
  std::error_code error;
  const std::string web =
      settings.serve.web.empty() ? default_web_folder(fs::read_symlink("/proc/self/exe", error).string()) : settings.serve.web;
  if (fs::exists(fs::path(web) / "index.html", error)) {
    findings.push_back(Finding{"viewer", Health::good, "in " + web, ""});
  } else {
    findings.push_back(Finding{"viewer", Health::warning, "none in " + web + ": / shows a plain page",
                               "build with npm installed, or --web with its folder"});
  }
}

}  // namespace cordillera::server::doctor
