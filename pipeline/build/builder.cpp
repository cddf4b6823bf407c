#include "pipeline/build/builder.h"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "gpu/measure/sample_frames.h"
#include "gpu/measure/surface_memory.h"
#include "pipeline/build/build.h"
#include "pipeline/build/exact/exact_block.h"
#include "pipeline/build/exact/side_by_side.h"
#include "pipeline/build/tile_output.h"
#include "pipeline/finest/pixel_error.h"
#include "pipeline/finest/side_vertices.h"
#include "pipeline/plan/plan.h"
#include "pipeline/tile/chain.h"
#include "pipeline/tile/mesh_record.h"

namespace cordillera::pipeline {
namespace {

// Rows of a block's samples that one worker reads at a time. The higher a strip, the less is read twice: each looks 13 rows
// around it. But every worker should have one.
constexpr std::int64_t kStripRows = 128, kMostStripRows = 320, kPieceColumns = 256;

constexpr double kReadShare = 0.2,
                 kFinestShare = 0.75;  // of a block's time, until its samples are read and its finest level is built

/// Meshes of waves begin with many triangles over a limit that is near rounding. Edges are turned for all of them.
constexpr double kLeastLimitOfWaves = 2.1;

/// What a quality is to gpu::thin.
int height_rounds(const proto::BuildOptions& options) {
  return options.quality() == "fast" ? -1 : options.quality() == "best" ? 2 : 0;
}

}  // namespace

std::array<const BuiltTile*, 4> children_of(const proto::TileAddress& tile, const Tiles& below) {
  std::array<const BuiltTile*, 4> children{};
  for (std::size_t c = 0; c < 4; ++c) {
    const auto found = below.find(tile.child(static_cast<int>(c)));
    if (found != below.end()) children[c] = &found->second;
  }
  return children;
}

Builder::Builder(const proto::Plan& plan, Workers& workers, OpenSource open, Room room, const std::atomic<bool>& stop)
    : plan_(plan),
      lattice_(lattice_of(plan)),
      workers_(workers),
      open_(std::move(open)),
      room_(std::move(room)),
      stop_(stop),
      water_(plan_, workers, sources_),
      tiles_(workers, stop),
      exact_({workers.loop(), [this](std::size_t count, const auto& work) { workers_.with_caller(count, work); }}, stop) {}

std::size_t Builder::tasks_at_once() const {
  const unsigned threads = workers_.threads();
  if (threads <= 1) return 1;
  if (plan_.exact()) return exact_.at_once() + 1;   // one of them is read, or encoded
  constexpr std::uint32_t kMemoryOfTask_mib = 384;  // with its share of the threads'
  const std::size_t most = room_.memory_mib > 0 ? std::max(room_.memory_mib / kMemoryOfTask_mib, 1u) : SIZE_MAX;
  const std::size_t tiles = std::size_t{1} << 2 * std::min<std::uint32_t>(plan_.finest_level() - plan_.block_level(), 8);
  constexpr std::size_t kTilesOfThread = 64;  // so many in a block, and it seldom lets a thread wait
  return std::min(most, 2 + threads / std::max<std::size_t>(1, tiles / kTilesOfThread));
}

std::size_t Builder::tasks_ahead() const {
  if (workers_.threads() <= 1 || !plan_.exact() || !exact_.on_gpu()) return 0;
  return exact_ahead(plan_, room_.memory_mib);
}

proto::Result<void> Builder::prepare() {
  // Tile meshes come and go by the megabyte: given back to the system each time, half of the build would be page faults.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  if (plan_.exact()) {  // the device comes up while sources are opened
    constexpr std::size_t kMostOnCpu = 8, kMostOnGpu = 16;
    constexpr std::size_t kTurnsOfGpu = 4;  // some work while others do their part on the host, or wait for a few late windows
    const auto at_once = [&](std::size_t most) { return exact_at_once(plan_, workers_.threads(), room_.memory_mib, most); };
    const std::size_t on_gpu = at_once(kMostOnGpu), turns = std::min(on_gpu, kTurnsOfGpu);
    exact_.open(room_.device, {at_once(kMostOnCpu), 1}, {turns, on_gpu / turns});
  }
  const std::size_t on_their_way = tasks_at_once() + tasks_ahead() + 1;
  pixels_ = std::make_shared<raster::SharedPixels>(memory_for_pixels(plan_, on_their_way, room_.memory_mib));
  // With the plan as it is: its targets may be changed meanwhile.
  const auto open = [open = open_, plan = plan_, pixels = pixels_]() -> proto::Result<std::unique_ptr<raster::Source>> {
    auto source = open();
    if (!source.ok() || !*source) return source;  // merges have none
    (*source)->share_pixels(pixels, 0);
    return source_of_tiles(plan, std::move(*source));
  };
  if (const auto begun = sources_.open(workers_.threads(), open); !begun.ok()) return begun;
  if (const auto mask = water_.open(); !mask.ok()) return mask;
  if (plan_.exact() && (!has_levels_above(plan_) || merged_at_once(plan_))) return {};
  return tiles_.open(room_.device, plan_.exact() ? gpu::kStrategies.front() : strategy_of(plan_));
}

void Builder::use(const proto::Plan& plan, bool alone) {
  plan_ = plan, alone_ = alone;
  if (pixels_) pixels_->clear();  // what is built again is to take as long
}

proto::Result<void> Builder::opened() const { return plan_.exact() ? exact_.opened() : proto::Result<void>(); }
std::string Builder::device() const { return plan_.exact() ? exact_.device() : tiles_.device(); }

std::vector<raster::PixelPoint> Builder::pixels_in(const proto::TileAddress& tile, unsigned worker) {
  const auto source = sources_.of(worker);
  return source.ok() ? pixels_of(lattice_, tile, **source) : std::vector<raster::PixelPoint>();
}

/// False, too, where it cannot be asked: who reads is told why.
bool Builder::is_empty(const raster::Source::Window& w) {
  bool empty = false;
  workers_.each(1, [&](std::size_t, unsigned worker) {
    const auto source = sources_.of(worker);
    empty = source.ok() && (*source)->empty(lattice_, w.west, w.south, w.east - w.west + 1, w.north - w.south + 1);
  });
  return empty;
}

proto::Result<proto::Samples> Builder::read(const proto::TileAddress& node) {
  // Border chains look to either side.
  const raster::Source::Window window = node_window(plan_, node, rim_reach(lattice_, node.z));
  proto::Samples samples;
  if (window.west > window.east || window.south > window.north || is_empty(window)) return samples;
  samples.west = window.west;
  samples.south = window.south;
  samples.columns = static_cast<std::int32_t>(window.east - window.west + 1);
  samples.rows = static_cast<std::int32_t>(window.north - window.south + 1);
  const std::size_t count = static_cast<std::size_t>(samples.columns) * static_cast<std::size_t>(samples.rows);
  samples.height.resize(count);
  samples.flat_water.resize(count);
  if (const auto into = read_into(window, samples); !into.ok()) return into.problem();
  return samples;
}

proto::Result<void> Builder::read_into(const raster::Source::Window& window, proto::Samples& samples, Workers::Haste haste) {
  const std::int64_t columns = window.east - window.west + 1, rows = window.north - window.south + 1;
  std::mutex mutex;
  std::optional<proto::Problem> problem;
  std::atomic<bool> failed{false};  // a damaged file may take long to say so: once is enough
  const std::int64_t strip_rows = std::clamp<std::int64_t>(rows / workers_.threads(), kStripRows, kMostStripRows);
  const std::int64_t strips = (rows + strip_rows - 1) / strip_rows;
  // Each piece looks a little beyond its rim. One block alone has fewer strips than there are threads, though.
  const std::int64_t pieces = haste == Workers::Haste::none
                                  ? 1
                                  : std::clamp<std::int64_t>(2 * workers_.threads() / strips, 1, 1 + columns / kPieceColumns);
  const auto read = [&](std::size_t k, unsigned worker) {
    if (stop_ || failed) return;
    const std::int64_t strip = static_cast<std::int64_t>(k) / pieces, piece = static_cast<std::int64_t>(k) % pieces;
    const std::int64_t from = rows * strip / strips, west = columns * piece / pieces;
    const auto high = static_cast<std::int32_t>(rows * (strip + 1) / strips - from),
               wide = static_cast<std::int32_t>(columns * (piece + 1) / pieces - west);
    const auto source = sources_.of(worker);
    const auto part = source.ok() ? (*source)->sample(lattice_, window.west + west, window.south + from, wide, high)
                                  : proto::Result<proto::Samples>(source.problem());
    if (!part.ok()) {
      const std::lock_guard lock(mutex);
      if (!problem) problem = part.problem();
      failed = true;
      return;
    }
    for (std::int64_t r = 0; r < high; ++r) {
      const auto to = static_cast<std::ptrdiff_t>((window.south + from + r - samples.south) * samples.columns +
                                                  (window.west + west - samples.west));
      const auto of = static_cast<std::ptrdiff_t>(r * wide), end = of + static_cast<std::ptrdiff_t>(wide);
      std::copy(part->height.begin() + of, part->height.begin() + end, samples.height.begin() + to);
      std::copy(part->flat_water.begin() + of, part->flat_water.begin() + end, samples.flat_water.begin() + to);
    }
  };
  workers_.each(static_cast<std::size_t>(strips * pieces), read, haste);
  if (problem) return *problem;
  return {};
}

/// As many as tasks_at_once(), and those for whom somebody waits.
class Builder::BlockRoom {
 public:
  BlockRoom(Builder& builder, Workers::Haste haste) : builder_(builder) {
    std::unique_lock lock(builder_.rooms_mutex_);
    builder_.room_free_.wait(
        lock, [&] { return haste == Workers::Haste::somebody_waits || builder_.rooms_taken_ < builder_.tasks_at_once(); });
    ++builder_.rooms_taken_;
  }
  ~BlockRoom() {
    {
      const std::lock_guard lock(builder_.rooms_mutex_);
      --builder_.rooms_taken_;
    }
    builder_.room_free_.notify_all();
  }
  BlockRoom(const BlockRoom&) = delete;
  BlockRoom& operator=(const BlockRoom&) = delete;

 private:
  Builder& builder_;
};

proto::Result<Builder::SampleBlock> Builder::read_exact(const proto::TileAddress& node, Workers::Haste haste) {
  SampleBlock block{node, alone_ ? place_alone(plan_, node) : place_of_block(plan_, node), {}};
  if (block.place.west > block.place.east) return block;
  const raster::Source::Window all = block.place.window();
  raster::Source::Window window = node_window(plan_, node, 3);
  window.west = std::max(window.west, all.west), window.east = std::min(window.east, all.east);
  window.south = std::max(window.south, all.south), window.north = std::min(window.north, all.north);
  if (is_empty(window)) return block;
  block.samples = block.place.empty_samples();  // not before: a sparse raster would spend most of its time on pages
  if (const auto read = read_into(window, block.samples, haste); !read.ok()) return read.problem();
  return block;
}

proto::Result<FinishedTask> Builder::exact_block(const proto::TileAddress& node, const std::function<void(double)>& share,
                                                 const FinestSink& finest) {
  if (const auto problem = exact_.problem()) return *problem;
  FinishedTask task;
  task.node = node;
  const auto read = read_exact(node, finest.haste());
  if (!read.ok()) return read.problem();
  if (stop_) return kCancelled;
  if (read->samples.all_void()) return task;
  share(kReadShare);
  const BlockRoom taken(*this, finest.haste());
  const ReadPixels pixels = [this](const proto::TileAddress& tile, unsigned worker) { return pixels_in(tile, worker); };
  auto built = build_exact_block(plan_, node, read->place, read->samples, exact_, {workers_, pixels, finest},
                                 [&](double part) { share(kReadShare + (1 - kReadShare) * part); });
  if (stop_) return kCancelled;
  if (built.ok() && gathered_) gathered_->take(*built);
  return built;
}

proto::Result<Builder::SampleBlock> Builder::sample_block(const proto::TileAddress& node) {
  if (plan_.exact()) return read_exact(node, Workers::Haste::none);
  const raster::Source::Window w = node_window(plan_, node);
  auto samples = read(node);
  if (!samples.ok()) return samples.problem();
  return SampleBlock{node, BlockPlace{w.west, w.south, w.east, w.north}, std::move(*samples)};
}

proto::Result<std::vector<double>> Builder::count(const SampleBlock& block, int levels) {
  if (plan_.exact()) return count_exact_block(plan_, lattice_.finest_level - levels + 1, block.place, block.samples, exact_);
  const auto task = tiles_of_block(block.node, [](double) {}, {});
  if (!task.ok()) return task.problem();
  std::vector<double> triangles(static_cast<std::size_t>(levels));
  for (const EncodedTile& tile : task->tiles)
    triangles[static_cast<std::size_t>(lattice_.finest_level) - tile.record.level()] += tile.record.triangles();
  return triangles;
}

void Builder::encode(const LevelContext& context, std::vector<BuiltTile>& tiles, FinishedTask& task) {
  std::vector<EncodedTile> made;
  if (context.level->level() < static_cast<std::uint32_t>(lattice_.finest_level)) {
    made = encode_tiles(context, tiles, plan_.options(), workers_, &stop_);
  } else {
    std::vector<std::optional<EncodedTile>> encoded(tiles.size());
    finish_with_sides(context, tiles, workers_, [&](std::size_t k, unsigned worker) {
      if (stop_) return std::vector<gpu::MeshPoint>();
      const std::vector<raster::PixelPoint> pixels = pixels_in(tiles[k].tile, worker);
      // Of tiles that do not change what finish() measured is true still.
      const bool again = encoded[k].has_value();
      gpu::SurfaceMemory memory;
      FinishedFinest finished =
          finish_finest(plan_, context, tiles[k], pixels, again ? Measure::always : Measure::changed, memory);
      encoded[k] = std::move(finished.tile);
      return std::move(finished.on_sides);
    });
    made = without_gaps(encoded);
  }
  std::move(made.begin(), made.end(), std::back_inserter(task.tiles));
}

proto::Result<FinishedTask> Builder::block(const proto::TileAddress& node, const std::function<void(double)>& share,
                                           const FinestSink& sink) {
  auto task = tiles_of_block(node, share, sink);
  if (!task.ok() || !task->shows() || alone_) return task;
  auto water = water_.of(node);
  if (!water.ok()) return water.problem();
  task->water = std::move(*water);
  return task;
}

proto::Result<FinishedTask> Builder::tiles_of_block(const proto::TileAddress& node, const std::function<void(double)>& share,
                                                    const FinestSink& sink) {
  if (plan_.exact()) return exact_block(node, share, sink);
  FinishedTask task;
  task.node = node;
  const proto::Result<proto::Samples> samples = read(node);
  if (!samples.ok()) return samples.problem();
  if (samples->all_void()) return stop_ ? proto::Result<FinishedTask>(kCancelled) : task;
  share(kReadShare);
  const gpu::SampleFrames frames(lattice_, *samples);
  const SampleCounts counts(lattice_, *samples, workers_);
  Tiles below;
  for (int z = lattice_.finest_level; z >= node.z; --z) {
    LevelContext context{&lattice_, &level_plan(plan_, z), plan_.promise(), &*samples};
    context.frames = &frames;
    context.counts = &counts;
    context.rim_reach = rim_reach(lattice_, node.z);
    context.merges_above = z == node.z && z > static_cast<int>(plan_.min_level());
    context.height_rounds = height_rounds(plan_.options());
    context.least_limit = kLeastLimitOfWaves;
    context.sparse_start = strategy_of(plan_) == gpu::kStrategies.front();
    const std::vector<proto::TileAddress> addresses = touched_tiles(plan_, z, node);
    const bool finest = z == lattice_.finest_level;
    std::atomic<std::size_t> finished{0};
    const auto one_more = [&] {
      const double part = static_cast<double>(++finished) / static_cast<double>(addresses.size());
      if (finest) share(kReadShare + (kFinestShare - kReadShare) * part);
    };
    std::vector<BuiltTile> built = tiles_.simplify(
        context, addresses.size(),
        [&](std::size_t k) {
          return finest ? prepare_finest(context, addresses[k])
                        : prepare_parent(context, addresses[k], children_of(addresses[k], below));
        },
        one_more);
    if (stop_) return kCancelled;
    encode(context, built, task);
    if (finest && sink && !stop_) sink.take(task.tiles);
    below.clear();
    for (BuiltTile& tile : built) below.emplace(tile.tile, std::move(tile));
    // Each level above costs about a third of the one below.
    share(1 - (1 - kFinestShare) * std::pow(1.0 / 3, lattice_.finest_level - z));
  }
  if (stop_) return kCancelled;
  if (node.z > static_cast<int>(plan_.min_level()) && !below.empty()) task.mesh = {node, to_bytes(below.begin()->second)};
  return task;
}

bool Builder::by_regions() const { return merged_at_once(plan_) && (room_.quarter_side > 0 || !has_one_ground(plan_)); }

void Builder::gather_for_merge() {
  if (by_regions()) return;
  constexpr double kMostOfMemory = 1.0 / 16;
  auto gathered = std::make_unique<GatheredBlocks>(plan_, workers_, stop_);
  if (gathered->bytes() > kMostOfMemory * memory_for_blocks(room_.memory_mib)) return;
  gathered_ = std::move(gathered);
  gathered_->begin();
}

proto::Result<FinishedTask> Builder::merge_at_once(const ChildMesh& mesh_of, const std::function<void(double)>& share) {
  pixels_->clear();
  if (by_regions()) {
    exact_.give_back_memory();  // of a large ground's it is a good part
    return build_regions_above(plan_, mesh_of,
                               {exact_, workers_, stop_, share, regions_at_once(workers_.threads(), room_.memory_mib)},
                               room_.quarter_side > 0 ? room_.quarter_side : kQuarterSide);
  }
  constexpr std::size_t kManyBlocks = 64;
  auto gathered = gathered_ ? std::move(gathered_) : std::make_unique<GatheredBlocks>(plan_, workers_, stop_);
  if (gathered->count() > kManyBlocks) exact_.give_back_memory();
  auto above = gathered->all(mesh_of);
  if (stop_) return kCancelled;
  if (!above.ok()) return above.problem();
  if (!*above) {
    FinishedTask nothing;
    nothing.node = node_above(plan_);
    return nothing;
  }
  std::vector<proto::TileAddress> consumed = gathered->those_with_a_mesh();
  gathered.reset();  // its meshes are one by now
  auto task = build_exact_above(plan_, std::move(**above), exact_, workers_, share);
  if (stop_) return kCancelled;
  if (task.ok()) task->consumed = std::move(consumed);
  return task;
}

proto::Result<FinishedTask> Builder::merge(const proto::TileAddress& node, const ChildMesh& mesh_of,
                                           const std::function<void(double)>& share) {
  if (merged_at_once(plan_)) return merge_at_once(mesh_of, share);
  FinishedTask task;
  task.node = node;
  std::array<BuiltTile, 4> tiles;
  std::array<const BuiltTile*, 4> children{};
  for (std::size_t c = 0; c < 4; ++c) {
    const proto::TileAddress child = node.child(static_cast<int>(c));
    const auto bytes = mesh_of(child);
    if (!bytes.ok()) return bytes.problem();
    if (!*bytes) continue;
    proto::Result<BuiltTile> tile = tile_from_bytes(child, **bytes);
    if (!tile.ok()) return tile.problem();
    tiles[c] = std::move(*tile);
    children[c] = &tiles[c];
    task.consumed.push_back(child);
  }
  LevelContext context{&lattice_, &level_plan(plan_, node.z), plan_.promise(), nullptr};
  context.merges_above = node.z > static_cast<int>(plan_.min_level());
  context.height_rounds = height_rounds(plan_.options());
  std::vector<BuiltTile> built =
      tiles_.simplify(context, 1, [&](std::size_t) { return prepare_parent(context, node, children); });
  if (stop_) return kCancelled;
  encode(context, built, task);
  if (node.z > static_cast<int>(plan_.min_level()) && !built.empty()) task.mesh = {node, to_bytes(built.front())};
  return task;
}

}  // namespace cordillera::pipeline
