#include "pipeline/build/build.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "pipeline/build/blank_manifest.h"
#include "pipeline/build/builder.h"
#include "pipeline/build/pilot.h"
#include "pipeline/build/provisional.h"
#include "pipeline/build/stages.h"
#include "pipeline/build/water_build.h"
#include "pipeline/plan/plan.h"
#include "pipeline/progress/teller.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/store/mesh_files.h"
#include "pipeline/store/store.h"
#include "pipeline/store/store_place.h"
#include "proto/ellipsoid.h"
#include "proto/mesh.h"
#include "proto/version.h"
#include "raster/open/raster_state.h"
#include "raster/pixels/decimation.h"
#include "raster/pixels/short_number.h"
#include "raster/sample/back_projection.h"
#include "raster/storage/storage.h"
#include "raster/voids/filled_source.h"

namespace cordillera::pipeline {
namespace {

/// What a raster without a triangle holds all the same.
struct HeightsSeen {
  bool within = false;                           ///< a height within the limit
  std::optional<std::pair<double, double>> far;  ///< the least and the greatest of those beyond it, in metres
  int own_level = -1;                            ///< the first level as fine as the raster; negative: unknown
  double latitude_deg = 0;                       ///< of its middle
};

/// Places in a row and rows that are looked at: all pixels of a small raster, some of a large one.
std::size_t places_across(const proto::Source& source) {
  constexpr std::size_t kSome = 64, kSmall = 256;
  const std::size_t pixels = std::max(source.columns(), source.rows());
  return pixels <= kSmall ? std::max(kSome, 2 * pixels) : kSome;
}

/// At places spread over one raster, until a height within the limit is found. A reader takes what is out of range for a void. So
/// the raster is read once more at a scale where every height is within it.
HeightsSeen heights_seen(const BuildRequest& request) {
  constexpr double kScale = 1e-26;  // 1e30 is the greatest value that is no void
  HeightsSeen seen;
  if (!request.members.empty()) return seen;
  proto::BuildOptions options = request.options;
  options.set_z_scale((options.has_z_scale() ? options.z_scale() : 1) * kScale);
  options.clear_z_offset();
  options.clear_max_level();
  const auto source = raster::open_source(request.raster_path, request.raster_name, request.trust, options);
  if (!source.ok() || (*source)->description().bbox_size() != 4) return seen;
  if (const auto levels = level_range((*source)->description(), options); levels.ok()) seen.own_level = levels->first;
  const auto& bbox = (*source)->description().bbox();
  const double width_deg = bbox[2] - bbox[0] + (bbox[0] > bbox[2] ? 360 : 0);  // over the antimeridian
  seen.latitude_deg = (bbox[1] + bbox[3]) / 2;
  const std::size_t across = places_across((*source)->description());
  std::vector<double> longitude_deg(across), latitude_deg(across), height(across);
  const auto share = [&](std::size_t k) { return (static_cast<double>(k) + 0.5) / static_cast<double>(across); };
  for (std::size_t k = 0; k < across; ++k) longitude_deg[k] = std::remainder(bbox[0] + width_deg * share(k), 360);
  for (std::size_t row = 0; row < across; ++row) {  // a row at a time: what is read at once stays small
    std::fill(latitude_deg.begin(), latitude_deg.end(), bbox[1] + (bbox[3] - bbox[1]) * share(row));
    if (!(*source)->nearest(longitude_deg, latitude_deg, height.data()).ok()) return {};
    for (const double scaled : height) {
      if (std::isnan(scaled)) continue;
      const double height_m = scaled / kScale + request.options.z_offset();
      seen.within = std::abs(height_m) <= proto::kMaxHeight_m;
      if (seen.within) return seen;
      if (!seen.far) seen.far.emplace(height_m, height_m);
      seen.far->first = std::min(seen.far->first, height_m);
      seen.far->second = std::max(seen.far->second, height_m);
    }
  }
  return seen;
}

/// Data between the samples of the finest level: it, or the bbox, is narrower than a cell, or the level is coarser than the
/// raster.
proto::Problem between_samples(const BuildRequest& request, const HeightsSeen& seen) {
  const bool asked = request.options.has_max_level(), boxed = request.options.bbox_size() > 0;
  const int level = asked ? static_cast<int>(request.options.max_level()) : seen.own_level;
  const proto::Lattice lattice{level};
  const double row = (seen.latitude_deg + 90) / 180 * static_cast<double>(lattice.rows());
  const double cell_m = std::round(proto::cell_height_m(lattice, std::llround(row)) * 10) / 10;
  const std::string detail = "the cells of level " + std::to_string(level) + " are so wide (" + raster::short_number(cell_m) +
                             " m) that no three neighbouring samples lie on the data of " + request.raster_name +
                             (boxed ? " inside the bbox" : "");
  if (level < seen.own_level)
    return {"option-invalid", detail,
            "a finer max_level; the first that is as fine as the raster is " + std::to_string(seen.own_level), "max_level"};
  const std::string wider = boxed ? "a wider bbox" : "wider data";
  return {"raster-all-nodata", detail, level < proto::kMaxLevel ? "a finer max_level, or " + wider : wider,
          boxed ? "bbox" : "max_level"};
}

}  // namespace

proto::Result<std::unique_ptr<raster::Source>> open_source(const BuildRequest& request) {
  const std::uint32_t limit_cells = raster::fill_limit_cells(request.options);
  if (!request.members.empty())
    return raster::fill_enclosed_voids(raster::make_mosaic(request.members, request.options.feather()), limit_cells);
  if (!request.decimation)
    return raster::open_filled_source(request.raster_path, request.raster_name, request.trust, request.options);
  auto source =
      raster::open_decimated(request.raster_path, request.raster_name, request.trust, request.options, request.decimation);
  return source.ok() ? raster::fill_enclosed_voids(std::move(*source), limit_cells) : std::move(source);
}

std::unique_ptr<raster::Source> source_of_tiles(const proto::Plan& plan, std::unique_ptr<raster::Source> source) {
  const double within_m = pixels_within_m(plan);
  return within_m > 0 ? raster::project_back(std::move(source), static_cast<int>(plan.finest_level()), within_m)
                      : std::move(source);
}

proto::Result<proto::Plan> plan_of(const BuildRequest& request, raster::Source& source) {
  if (const auto checked = check_water(request.options); !checked.ok()) return checked.problem();
  auto plan = make_plan(source, request.options);
  if (!plan.ok()) return plan;
  if (request.block_samples > 0) use_smaller_blocks(*plan, request.block_samples);
  plan->set_program(proto::kProgram);
  plan->set_source_state(state_of(request));
  return plan;
}

std::string state_of(const BuildRequest& request) {
  std::string state = request.members.empty() ? raster::state_of_raster(request.raster_path, request.trust) : "";
  for (const raster::MosaicMember& member : request.members)
    state += member.path + "\n" + member.state + "\n" + member.options.SerializeAsString();
  if (!request.members.empty()) state = hex(content_hash(state));
  const std::string& mask = request.options.water_mask();
  return mask.empty() ? state : state + "; water mask " + raster::state_of(mask);
}

proto::Problem without_data(const BuildRequest& request) {
  const bool boxed = request.options.bbox_size() > 0;
  const std::string where = boxed ? " inside the bbox" : "";
  const HeightsSeen seen = heights_seen(request);
  if (seen.within && (request.options.has_max_level() || seen.own_level >= 0)) return between_samples(request, seen);
  if (const auto& far = seen.far; far && !seen.within)
    return {
        "raster-heights-out-of-range",
        request.raster_name + " has no heights within 16384 m of zero" + where + ": they are " +
            raster::short_number(far->first) + " to " + raster::short_number(far->second) +
            " m at the places that were looked at",
        "heights in metres, z_scale= for another unit (z_scale=0.001 for millimetres), or nodata= for a value that means no data",
        "z_scale"};
  return {"raster-all-nodata",
          (request.members.size() == 1 ? request.members.front().name : request.raster_name) + " has no data" + where +
              ": nowhere do three neighbouring samples have heights within 16384 m of zero",
          "a raster with some data, z_scale= for heights in another unit than metres, or voids= with a height to put where there "
          "are none",
          boxed ? "bbox" : ""};
}

proto::Result<proto::Manifest> build(const BuildRequest& request, const ProgressCallback& progress,
                                     const std::atomic<bool>& stop) {
  Teller teller(progress);
  teller.stage("open", 1);
  const auto source = open_source(request);
  if (!source.ok()) return source.problem();
  const std::future<void> device = wake_device(request.options, (*source)->description());
  auto plan = plan_of(request, **source);
  if (!plan.ok()) return plan.problem();
  Workshop shop(request, *plan, stop);
  Builder& builder = shop.builder;
  if (const auto ready = builder.prepare(); !ready.ok()) return ready.problem();
  if (request.options.keep_size() > 0) {
    teller.stage("plan", 1);
    if (const auto piloted = run_pilot(builder, *plan, stop); !piloted.ok()) return piloted.problem();
  }
  auto place = request.old_stays && request.other == Existing::replace ? StorePlace::replacing(request.store_path, *plan)
                                                                       : StorePlace(request.store_path);
  if (!place.ok()) return place.problem();
  // A store that is there is not touched for a device that is not.
  if (std::filesystem::exists(place->path())) {
    if (const auto ready = builder.opened(); !ready.ok()) return ready.problem();
  }
  auto store = StoreWriter::open(place->path(), *plan, request.other);
  if (!store.ok()) return store.problem();
  // While blocks are made, where there is a thread for it; a lazy build seldom comes to its end.
  const bool at_the_end =
      shop.workers.threads() == 1 || (request.follower && request.follower->lazy()) || is_provisional(request);
  auto values = std::async(at_the_end ? std::launch::deferred : std::launch::async | std::launch::deferred,
                           [&] { return look_at_values(**source); });
  const Site site{*plan, shop, **store, teller, request.follower, Consumed::removed, stop};
  const auto made = make_stages(site, stages_of(*plan));
  if (const auto ready = builder.opened(); !ready.ok()) {  // so the store was begun here
    store->reset();
    remove_store(place->path());
    return ready.problem();
  }
  if (!made.ok()) return made.problem();
  const proto::Source& described = request.decimation ? request.decimation->of : (*source)->description();
  proto::Manifest manifest = blank_manifest(request, *plan, described, {shop.workers.threads(), builder.device()});
  manifest.set_provisional(is_provisional(request));
  if (!is_provisional(request)) {
    note_values(values.get(), manifest);
    note_cut_voids(**source, *plan, manifest);
  }
  manifest.set_device(builder.device());  // in the manifest alone: tiles are the same bytes wherever they were made
  auto published = (*store)->publish(std::move(manifest));
  if (!published.ok() && published.problem().type == "no-data") return without_data(request);
  if (published.ok()) {
    store->reset();
    if (const auto settled = place->settle(); !settled.ok()) return settled.problem();
  }
  teller.tell(1);
  return published;
}

}  // namespace cordillera::pipeline
