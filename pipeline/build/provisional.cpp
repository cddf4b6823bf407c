#include "pipeline/build/provisional.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "pipeline/build/sharpen.h"
#include "pipeline/plan/plan.h"
#include "pipeline/plan/plan_options.h"
#include "pipeline/threads/workers.h"
#include "raster/pixels/decimation.h"
#include "raster/sample/back_projection.h"

namespace cordillera::pipeline {
namespace {

/// Of one among several rasters, however small it is beside the others.
constexpr std::int64_t kFewestPixels = 64;
/// Of a raster of which a part is built: all of it is thinned out.
constexpr double kMostPixels = 1 << 26;

std::int64_t samples_at(const raster::Source& source, int level) {
  const raster::Source::Window w = source.window({level});
  return w.west > w.east || w.south > w.north ? 0 : (w.east - w.west + 1) * (w.north - w.south + 1);
}

/// How many pixels of all of the raster have the spacing of the level; none: too many beside those of the part that is built.
std::optional<std::int64_t> pixels_at(const raster::Source& source, const proto::BuildOptions& options, int level) {
  const std::int64_t samples = samples_at(source, level);
  if (options.bbox_size() == 0) return samples;
  const proto::Source& of = source.description();
  const double across = std::max(1.0, raster::spacing(of, proto::Lattice{level}));
  const double pixels = 1.0 * of.columns() * of.rows() / (across * across);
  return pixels <= kMostPixels ? std::optional(std::max(samples, static_cast<std::int64_t>(pixels))) : std::nullopt;
}

/// What takes the time of a build is left out; the error asked for doubles a level upwards, as it does in the final tiles.
proto::BuildOptions quick(const proto::BuildOptions& asked, int finest, int level) {
  proto::BuildOptions options = asked;
  options.set_strategy(kAutoStrategy);
  options.set_quality("fast");
  options.set_device("cpu");  // a GPU would still be starting
  options.set_pixels(raster::kLatticePixels);
  options.clear_keep();
  options.clear_water_mask();
  options.set_max_level(static_cast<std::uint32_t>(level));
  if (asked.has_error()) options.set_error(std::ldexp(asked.error(), finest - level));
  return options;
}

/// The pixels of one raster among several that a build of the level needs; null: it has none to give.
proto::Result<std::shared_ptr<const raster::Decimation>> few_of(const raster::MosaicMember& member, int level) {
  auto own = raster::open_source(member.path, member.name, member.trust, member.options);
  if (!own.ok()) return own.problem();
  const auto wanted = pixels_at(**own, member.options, level);
  if (!wanted) return std::shared_ptr<const raster::Decimation>();
  return (*own)->decimate(std::max(*wanted, kFewestPixels));
}

/// The pixels that a build of the level needs, in place of all. False: a raster has none to give.
proto::Result<bool> thin_out(BuildRequest& request, raster::Source& source, int level) {
  if (request.members.empty()) {
    const auto wanted = pixels_at(source, request.options, level);
    if (!wanted) return false;
    auto pixels = source.decimate(*wanted);
    if (!pixels.ok()) return pixels.problem();
    request.decimation = std::move(*pixels);
    return request.decimation != nullptr;
  }
  // Each of them. Of those with overviews what takes the time is to open them; of others together no more is decoded than of a
  // few.
  constexpr double kMostOfAll_px = 4 * raster::kMostDecoded_px;
  std::atomic<double> decoded_px{0};
  std::vector<std::optional<proto::Problem>> problems(request.members.size());
  std::atomic<bool> none{false};
  Workers(request.options.threads()).each(request.members.size(), [&](std::size_t k, unsigned) {
    if (none) return;
    auto pixels = few_of(request.members[k], level);
    if (!pixels.ok()) problems[k] = pixels.problem();
    if (!pixels.ok() || *pixels == nullptr || (decoded_px += (*pixels)->decoded_px) > kMostOfAll_px)
      none = true;
    else
      request.members[k].decimation = std::move(*pixels);
  });
  for (const auto& problem : problems)
    if (problem) return *problem;
  return !none;
}

}  // namespace

bool is_provisional(const BuildRequest& request) {
  return request.decimation || (!request.members.empty() && request.members.front().decimation);
}

proto::Result<std::optional<int>> provisional_level(const BuildRequest& request, const raster::Source& source,
                                                    std::int64_t most_samples) {
  const std::optional<int> none;
  if (request.members.size() > kMostLookedAt) return none;
  const auto range = level_range(source.description(), request.options);
  if (!range.ok()) return range.problem();
  const auto [finest, coarsest] = *range;
  if (samples_at(source, finest) <= kWorthwhile * most_samples) return none;
  int level = finest;
  while (level >= coarsest && samples_at(source, level) > most_samples) --level;
  return level < coarsest || samples_at(source, level) == 0 ? none : std::optional(level);
}

proto::Result<std::optional<BuildRequest>> provisional_request(const BuildRequest& request, raster::Source& source,
                                                               std::int64_t most_samples) {
  const std::optional<BuildRequest> none;
  const auto level = provisional_level(request, source, most_samples);
  if (!level.ok()) return level.problem();
  if (!*level) return none;
  const auto range = level_range(source.description(), request.options);
  BuildRequest small = request;
  const auto thinned = thin_out(small, source, **level);
  if (!thinned.ok()) return thinned.problem();
  if (!*thinned) return none;
  small.block_samples = 0;
  small.options = quick(request.options, range->first, **level);
  return std::optional(std::move(small));
}

proto::Result<BlockLevel> block_level_of(const BuildRequest& request, raster::Source& source) {
  BuildRequest planned = request;
  // Blocks depend on no share or error; to choose one, or steps for a small one, the raster would be read here and there.
  planned.options.clear_keep();
  planned.options.set_error(kGreatestError_m);
  const auto plan = plan_of(planned, source);
  if (!plan.ok()) return plan.problem();
  const int level = static_cast<int>(plan->block_level());
  return BlockLevel{level, samples_at(source, level), has_blocks_to_show(*plan)};
}

}  // namespace cordillera::pipeline
