#include "pipeline/build/builder.h"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "pipeline/build/build.h"
#include "pipeline/build/exact/exact_block.h"
#include "pipeline/build/exact/side_by_side.h"
#include "pipeline/finest/pixel_error.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/plan.h"

namespace cordillera::pipeline {
namespace {

// Rows of a block's samples that one worker reads at a time. The higher a strip, the less is read twice: each looks 13 rows
// around it. But every worker should have one.
constexpr std::int64_t kStripRows = 128, kMostStripRows = 320, kPieceColumns = 256;

constexpr double kReadShare = 0.2;  // of a block's time, until its samples are read

}  // namespace

Builder::Builder(const proto::Plan& plan, Workers& workers, OpenSource open, Room room, const std::atomic<bool>& stop)
    : plan_(plan),
      lattice_(lattice_of(plan)),
      workers_(workers),
      open_(std::move(open)),
      room_(std::move(room)),
      stop_(stop),
      water_(plan_, workers, sources_),
      strategy_(workers, stop),
      exact_({workers.loop(), [this](std::size_t count, const auto& work) { workers_.with_caller(count, work); }}, stop) {}

std::size_t Builder::tasks_at_once() const {
  return workers_.threads() <= 1 ? 1 : exact_.at_once() + 1;  // one of them is read, or encoded
}

std::size_t Builder::tasks_ahead() const {
  if (workers_.threads() <= 1 || !exact_.on_gpu()) return 0;
  return exact_ahead(plan_, room_.memory_mib);
}

proto::Result<void> Builder::prepare() {
  // Tile meshes come and go by the megabyte: given back to the system each time, half of the build would be page faults.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  constexpr std::size_t kMostOnCpu = 8, kMostOnGpu = 16;
  constexpr std::size_t kTurnsOfGpu = 4;  // some work while others do their part on the host, or wait for a few late windows
  const auto at_once = [&](std::size_t most) { return exact_at_once(plan_, workers_.threads(), room_.memory_mib, most); };
  const std::size_t on_gpu = at_once(kMostOnGpu), turns = std::min(on_gpu, kTurnsOfGpu);
  exact_.open(room_.device, {at_once(kMostOnCpu), 1}, {turns, on_gpu / turns});  // it comes up while sources are opened
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
  return strategy_.open(room_.device, plan_);
}

void Builder::use(const proto::Plan& plan, bool alone) {
  plan_ = plan, alone_ = alone;
  if (pixels_) pixels_->clear();  // what is built again is to take as long
}

proto::Result<void> Builder::opened() const { return exact_.opened(); }
std::string Builder::device() const { return strategy_.is_open() ? strategy_.device() : exact_.device(); }

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

proto::Result<Builder::SampleBlock> Builder::read(const proto::TileAddress& node, Workers::Haste haste) {
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

proto::Result<FinishedTask> Builder::tiles_of_block(const proto::TileAddress& node, const std::function<void(double)>& share,
                                                    const FinestSink& finest) {
  if (const auto problem = exact_.problem()) return *problem;
  FinishedTask task;
  task.node = node;
  const auto block = read(node, finest.haste());
  if (!block.ok()) return block.problem();
  if (stop_) return kCancelled;
  if (block->samples.all_void()) return task;
  share(kReadShare);
  const BlockRoom taken(*this, finest.haste());
  const ReadPixels pixels = [this](const proto::TileAddress& tile, unsigned worker) { return pixels_in(tile, worker); };
  auto built = build_block(plan_, node, block->place, block->samples, exact_, {workers_, pixels, finest, strategy_},
                           [&](double part) { share(kReadShare + (1 - kReadShare) * part); });
  if (stop_) return kCancelled;
  if (built.ok() && gathered_) gathered_->take(*built);
  return built;
}

proto::Result<Builder::SampleBlock> Builder::sample_block(const proto::TileAddress& node) {
  return read(node, Workers::Haste::none);
}

proto::Result<std::vector<double>> Builder::count(const SampleBlock& block, int levels) {
  return count_block(plan_, lattice_.finest_level - levels + 1, block.place, block.samples, {exact_, workers_, strategy_});
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

bool Builder::by_regions() const { return room_.quarter_side > 0 || !has_one_ground(plan_); }

void Builder::gather_for_merge() {
  if (by_regions()) return;
  constexpr double kMostOfMemory = 1.0 / 16;
  auto gathered = std::make_unique<GatheredBlocks>(plan_, workers_, stop_);
  if (gathered->bytes() > kMostOfMemory * memory_for_blocks(room_.memory_mib)) return;
  gathered_ = std::move(gathered);
  gathered_->begin();
}

proto::Result<FinishedTask> Builder::merge(const ChildMesh& mesh_of, const std::function<void(double)>& share) {
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
  auto task = build_above(plan_, std::move(**above), exact_, workers_, share);
  if (stop_) return kCancelled;
  if (task.ok()) task->consumed = std::move(consumed);
  return task;
}

}  // namespace cordillera::pipeline
