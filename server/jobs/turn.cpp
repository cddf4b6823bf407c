#include "server/jobs/turn.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "raster/disk/write_all.h"
#include "raster/storage/storage.h"
#include "server/datasets/upload.h"
#include "server/http/json.h"
#include "server/log/log.h"

namespace cordillera::server::updates {
namespace {

namespace fs = std::filesystem;

proto::Problem cannot(const std::string& what) {
  return {"store-write", what + ": " + std::strerror(errno), "a writable disk with free space", ""};
}

std::string about(const proto::SourceChange& change) {
  const std::string& name = change.source().spec().name().empty() ? change.source().id() : change.source().spec().name();
  return (change.kind() == "add"      ? "added "
          : change.kind() == "remove" ? "removed "
                                      : "changed ") +
         name + (change.more_size() > 0 ? " and " + std::to_string(change.more_size()) + " more" : "");
}

/// `from` takes the place of `to`, on disk for good.
proto::Result<void> moved(const fs::path& from, const fs::path& to) {
  if (!raster::put_in_place(from, to)) return cannot(to.filename().string() + " cannot be put into its place");
  return {};
}

}  // namespace

bool is_done(const Layout& layout, const std::string& id, const proto::SourceChange& change) {
  const auto served = version_in(layout.store(id));
  return served && *served && (*served)->change() == change.id();
}

proto::Result<void> prepare(const Layout& layout, const std::string& id, const proto::SourceChange& change) {
  proto::DatasetVersion served;
  // Nothing is before the first change. Whatever lies in its place is replaced, which harms nobody; a refusal would cost the
  // rasters that were posted.
  if (change.number() > 1) {
    auto before = version_in(layout.store(id));
    if (!before)
      return proto::Problem{"store-damaged", "of which rasters dataset " + id + " was made cannot be read",
                            before.problem().accepted, ""};
    if (*before) served = std::move(**before);
  }
  const auto sources = applied({served.sources().begin(), served.sources().end()}, change);
  if (!sources.ok()) return sources.problem();
  proto::DatasetVersion version;
  version.set_number(change.number());
  version.set_before(served.number());
  version.set_change(change.id());
  version.set_about(about(change));
  version.set_created(now_text());
  for (const proto::DatasetSource& source : *sources) *version.add_sources() = source;
  const auto written = raster::write_whole((layout.dataset(id) / kTargetFile).string(), to_json_line(version) + "\n");
  return written.ok() ? proto::Result<void>() : cannot("what is to be built cannot be written down");
}

proto::Result<void> publish(const Layout& layout, const std::string& id, std::size_t keep) {
  const fs::path folder = layout.dataset(id), store = layout.store(id);
  const auto served = version_in(store);
  if (served && *served && keep > 0) {
    const fs::path kept = kept_store(folder, (*served)->number());
    std::error_code ignored;
    fs::create_directory(kept.parent_path(), ignored);
    // Two names of one file until the rename: it costs no room.
    if (link(store.c_str(), kept.c_str()) != 0 && errno != EEXIST) return cannot("the version before cannot be kept");
    if (!raster::sync_path(kept.parent_path())) return cannot("the version before cannot be kept");
  }
  return moved(folder / kNextStore, store);
}

proto::Result<void> roll_back(const Layout& layout, const std::string& id, std::uint32_t number) {
  return moved(kept_store(layout.dataset(id), number), layout.store(id));
}

}  // namespace cordillera::server::updates
