#include "server/jobs/process/update_job.h"

#include "pipeline/work/update.h"
#include "pipeline/work/work_plan.h"
#include "proto/files.h"
#include "raster/mosaic/datum_notes.h"
#include "server/datasets/ledger.h"
#include "server/http/json.h"
#include "server/jobs/process/provisional_job.h"
#include "server/jobs/process/sharpener.h"

namespace cordillera::server::updates {
namespace {

namespace fs = std::filesystem;
namespace work = pipeline::work;

/// The options of the build with those of one raster over them.
proto::BuildOptions over(const proto::BuildOptions& build, const proto::BuildOptions& own) {
  proto::BuildOptions options = build;
  options.clear_crs();  // it is for a raster that names none
  options.MergeFrom(own);
  return options;
}

/// As the version before found it, if that read the same bytes in the same way.
std::optional<raster::MosaicMember> known(const std::optional<proto::WorkPlan>& before, const proto::DatasetSource& source,
                                          const proto::BuildOptions& options) {
  for (int k = 0; before && k < before->sources_size(); ++k) {
    const proto::PlannedSource& planned = before->sources(k);
    if (planned.spec().path() != source.spec().path() || planned.state() != source.hash()) continue;
    auto member = work::member_of(planned, source.spec().path(), raster::Trust::posted_file);
    if (work::reading(options).SerializeAsString() != member.options.SerializeAsString()) continue;
    return member;
  }
  return std::nullopt;
}

/// While a dataset has no version yet.
void first_look(pipeline::BuildRequest request, const pipeline::ProgressCallback& progress, const std::atomic<bool>& stop) {
  const auto source = pipeline::open_source(request);
  if (!source.ok()) return;
  const auto block_samples = work::first_block_samples(request, **source);
  if (!block_samples.ok()) return;
  request.block_samples = *block_samples;
  make_provisional(request, **source, ".", progress, stop);
}

}  // namespace

proto::Result<proto::Manifest> build_target(const proto::Job& job, const fs::path& folder, const SizeCheck& too_large,
                                            const pipeline::ProgressCallback& progress, const std::atomic<bool>& stop) {
  std::error_code error;
  fs::current_path(folder, error);
  const auto text = proto::bytes_of_file(kTargetFile);
  proto::DatasetVersion version;
  if (error || !text || !from_json(*text, &version) || version.sources_size() == 0) {
    return proto::Problem{"internal", "the version to be built cannot be read", "", ""};
  }
  const auto before = work::plan_in(kStoreFile);
  work::UpdateOrder order;
  std::optional<proto::Problem> beside;  // the box does not touch it: it is none of those that are built
  for (const proto::DatasetSource& source : version.sources()) {
    const proto::BuildOptions options = over(job.options(), source.spec().options());
    auto member = known(before, source, options);
    if (!member) {
      auto examined = raster::examine_pixels(source.spec().path(), source.spec().name(), raster::Trust::posted_file, options);
      if (!examined.ok() && raster::lies_beside(examined.problem())) {
        beside = examined.problem();
        continue;
      }
      if (!examined.ok()) return examined.problem();
      if (auto refused = too_large(source.spec().name(), examined->description)) return *refused;
      member = std::move(*examined);
      member->state = source.hash();  // its bytes: a copy of the folder has the same keys
    }
    order.request.members.push_back(std::move(*member));
  }
  if (order.request.members.empty() && beside) return *beside;
  order.request.raster_name = job.name();
  order.request.trust = raster::Trust::posted_file;
  order.request.id = job.id();
  order.request.store_path = kNextStore;
  order.request.options = job.options();
  for (const std::string& note : raster::notes_on_datums(order.request.members)) order.request.options.add_warnings(note);
  if (before) order.before = kStoreFile;
  if (job.provisional() && !before) first_look(order.request, progress, stop);
  if (job.dry_run()) return proto::Manifest();  // that was all
  order.notes.push_back({kVersionNote, version.SerializeAsString()});
  Sharpener sharpener(".", job.lazy() ? Sharpener::Blocks::looked_at : Sharpener::Blocks::all);
  if ((job.provisional() || job.lazy()) && !before) order.request.follower = &sharpener;
  return work::update(order, progress, stop);
}

}  // namespace cordillera::server::updates
