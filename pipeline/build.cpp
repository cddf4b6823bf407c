#include "pipeline/build.h"

#include <cmath>

#include "gpu/simplify.h"
#include "pipeline/blank_manifest.h"
#include "pipeline/builder.h"
#include "pipeline/content_hash.h"
#include "pipeline/pilot.h"
#include "pipeline/plan.h"
#include "pipeline/store.h"
#include "pipeline/teller.h"
#include "pipeline/water_build.h"
#include "proto/mesh.h"
#include "proto/version.h"
#include "raster/storage.h"

namespace cordillera::pipeline {
namespace {

double samples_of(const proto::Plan& plan, const proto::TileAddress& node) {
  const raster::Source::Window w = node_window(plan, node);
  return w.west > w.east || w.south > w.north ? 0 : static_cast<double>(w.east - w.west + 1) * static_cast<double>(w.north - w.south + 1);
}

proto::Result<void> build_blocks(Builder& builder, const proto::Plan& plan, StoreWriter& store, Teller& teller, const std::atomic<bool>& stop) {
  const std::vector<proto::TileAddress> blocks = touched_tiles(plan, static_cast<int>(plan.block_level()));
  double total = 0, done = 0;
  for (const proto::TileAddress& node : blocks) total += samples_of(plan, node);
  teller.stage("build", total);
  for (const proto::TileAddress& node : blocks) {
    const double samples = samples_of(plan, node);
    if (!store.finished(node)) {
      if (stop) return proto::Problem{"cancelled", "the build was cancelled", "", ""};
      auto task = builder.block(node, [&](double share) { teller.tell(done + share * samples); });
      if (!task.ok()) return task.problem();
      if (const auto committed = store.commit(*task); !committed.ok()) return committed.problem();
      teller.committed_block();
    }
    done += samples;
    teller.tell(done);
  }
  return {};
}

proto::Result<void> merge_upwards(Builder& builder, const proto::Plan& plan, StoreWriter& store, Teller& teller, const std::atomic<bool>& stop) {
  double total = 0, done = 0;
  const int min_level = static_cast<int>(plan.min_level());
  for (int z = static_cast<int>(plan.block_level()) - 1; z >= min_level; --z) total += static_cast<double>(touched_tiles(plan, z).size());
  if (total == 0) return {};
  teller.stage("merge", total);
  for (int z = static_cast<int>(plan.block_level()) - 1; z >= min_level; --z) {
    for (const proto::TileAddress& node : touched_tiles(plan, z)) {
      if (stop) return proto::Problem{"cancelled", "the build was cancelled", "", ""};
      if (!store.finished(node)) {
        auto task = builder.merge(node, [&](const proto::TileAddress& child) { return store.mesh(child); });
        if (!task.ok()) return task.problem();
        if (const auto committed = store.commit(*task); !committed.ok()) return committed.problem();
      }
      teller.tell(++done);
    }
  }
  return {};
}

}  // namespace

proto::Result<std::unique_ptr<raster::Source>> open_source(const BuildRequest& request) {
  if (!request.members.empty()) return raster::make_mosaic(request.members, request.options.feather());
  return raster::open_source(request.raster_path, request.raster_name, request.trust, request.options);
}

proto::Result<proto::Plan> plan_of(const BuildRequest& request, raster::Source& source) {
  if (const auto checked = check_water(request.options); !checked.ok()) return checked.problem();
  auto plan = make_plan(source, request.options);
  if (!plan.ok()) return plan;
  plan->set_program(proto::kProgram);
  plan->set_source_state(state_of(request));
  return plan;
}

std::string state_of(const BuildRequest& request) {
  std::string state = request.members.empty() ? raster::state_of(request.raster_path) : "";
  for (const raster::MosaicMember& member : request.members) state += member.path + "\n" + member.state + "\n" + member.options.SerializeAsString();
  if (!request.members.empty()) state = hex(content_hash(state));
  const std::string& mask = request.options.water_mask();
  return mask.empty() ? state : state + "; water mask " + raster::state_of(mask);
}

proto::Problem without_data(const BuildRequest& request) {
  const bool boxed = request.options.bbox_size() > 0;
  return {"raster-all-nodata", request.raster_name + " has no data" + (boxed ? " inside the bbox" : "") + ": nowhere do three neighbouring samples have heights",
          "a raster with some data, or nodata= with a height to put there", boxed ? "bbox" : ""};
}

proto::Result<proto::Manifest> build(const BuildRequest& request, const ProgressCallback& progress, const std::atomic<bool>& stop) {
  Teller teller(progress);
  teller.stage("open", 1);
  const auto source = open_source(request);
  if (!source.ok()) return source.problem();
  auto plan = plan_of(request, **source);
  if (!plan.ok()) return plan.problem();
  Workers workers(request.options.threads());
  Builder builder(*plan, workers, [&] { return open_source(request); }, request.options.device(), stop);
  if (const auto ready = builder.prepare(); !ready.ok()) return ready.problem();
  if (request.options.keep_size() > 0) {
    teller.stage("plan", 1);
    if (const auto piloted = run_pilot(builder, *plan, stop); !piloted.ok()) return piloted.problem();
    builder.use(*plan);
  }
  auto store = StoreWriter::open(request.store_path, *plan, request.other);
  if (!store.ok()) return store.problem();
  if (const auto built = build_blocks(builder, *plan, **store, teller, stop); !built.ok()) return built.problem();
  if (const auto merged = merge_upwards(builder, *plan, **store, teller, stop); !merged.ok()) return merged.problem();
  teller.stage("publish", 1);
  if (const auto masked = build_water(*plan, workers, [&] { return open_source(request); }, **store, stop); !masked.ok()) return masked.problem();
  proto::Manifest manifest = blank_manifest(request, *plan, (*source)->description(), {workers.threads(), builder.device()});
  const double resampled_m = (*source)->resampling_error_m(lattice_of(*plan));
  manifest.mutable_source()->set_resampling_error(std::nearbyint(resampled_m / proto::kHeightStep_m) * proto::kHeightStep_m);
  manifest.set_device(builder.device());  // in the manifest alone: tiles are the same bytes wherever they were made
  auto published = (*store)->publish(std::move(manifest));
  if (!published.ok() && published.problem().type == "no-data") return without_data(request);
  teller.tell(1);
  return published;
}

}  // namespace cordillera::pipeline
