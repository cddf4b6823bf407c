// The driver of BatchMeter; included by surface_error_batch.cpp and surface_error_cuda.cu only. A Device runs steps over arrays:
// see waves.h.
#include <algorithm>
#include <optional>

#include "gpu/measure/sample_frames.h"
#include "gpu/measure/surface_meter.h"
#include "tests/bench/batch_meter/surface_error_batch.h"
#include "tests/bench/batch_meter/surface_error_rows.h"
#include "tests/bench/batch_meter/surface_error_steps.h"

namespace cordillera::gpu {

template <class Device>
class BatchMeterOn final : public BatchMeter {
 public:
  BatchMeterOn(std::unique_ptr<Device> device, ParallelFor parallel)
      : device_(std::move(device)), parallel_(std::move(parallel)) {}

  void keep(const proto::Lattice& lattice, const proto::Samples& samples, double ecef_step_m) override {
    device_->use();
    lattice_ = lattice;
    samples_ = &samples;
    frames_.emplace(lattice_, samples);
    ecef_step_m_ = ecef_step_m;
    const auto rows = proto::row_frames(lattice, samples.south, static_cast<std::size_t>(samples.rows));
    const auto columns = proto::column_frames(lattice, samples.west, static_cast<std::size_t>(samples.columns));
    any_void_ = std::find(samples.height.begin(), samples.height.end(), proto::kNoHeight) != samples.height.end();
    in_.samples = upload(heights_, samples.height.data(), samples.height.size());
    in_.columns = samples.columns;
    in_.row_frame = upload(row_frames_, rows.data(), rows.size());
    in_.column_frame = upload(column_frames_, columns.data(), columns.size());
    TileTally done;
    device_->zero(room(tally_, 1), 1);
    device_->copy_out(&done, tally_.data(), 1);  // what was lent to the copies ends here
  }

  std::vector<SurfaceError> measure(std::span<const TileSurface> tiles) override {
    device_->use();
    stages_.clear();
    std::vector<SurfaceError> results;
    results.reserve(tiles.size());
    for (std::size_t from = 0, to = 0; from < tiles.size(); from = to) {
      std::size_t triangles = 0;
      while (to < tiles.size() && (to == from || triangles + tiles[to].mesh->triangles.size() <= kTrianglesAtOnce)) {
        triangles += tiles[to++].mesh->triangles.size();
      }
      measure_some(tiles.subspan(from, to - from), results);
    }
    return results;
  }

  std::string device() const override { return device_->name(); }
  std::span<const proto::StageTime> stages() const override { return stages_; }

 private:
  // On the device a triangle takes some 200 bytes, a row 40.
  static constexpr std::size_t kTrianglesAtOnce = std::size_t{1} << 22;
  static constexpr std::uint32_t kRowsAtOnce = 1u << 24;

  template <class T>
  using Array = typename Device::template Array<T>;
  template <class T>
  using Staging = typename Device::template Staging<T>;

  template <class T>
  T* room(Array<T>& array, std::size_t count) {
    array.reserve(std::max<std::size_t>(count, 1));
    return array.data();
  }
  template <class T>
  T* upload(Array<T>& array, const T* from, std::size_t count) {
    if (count > 0) device_->copy_in(room(array, count), from, count);
    return room(array, count);
  }
  void end_stage(const char* name) { proto::add_time(stages_, name, watch_.lap()); }

  void measure_some(std::span<const TileSurface> tiles, std::vector<SurfaceError>& results) {
    watch_.lap();
    plan(tiles);
    pack(tiles);
    end_stage("pack");
    load();
    end_stage("upload");
    const std::vector<TileTally> tallies = run();
    end_stage("measure");
    const std::size_t first = results.size();
    results.resize(first + tiles.size());
    for (std::size_t t = 0; t < tallies.size(); ++t) results[first + t] = error_of(tallies[t]);
    parallel_(tiles.size(), [&](std::size_t t) {
      if (outside_[t] || tallies.empty()) results[first + t] = surface_error(input_of(tiles[t]), INFINITY);
    });
  }

  SurfaceErrorInput input_of(const TileSurface& tile) const {
    SurfaceErrorInput input{&lattice_, tile.tile, tile.mesh, samples_, ecef_step_m_};
    input.frames = &*frames_;
    return input;
  }

  /// What is known of every tile before its triangles are looked at.
  void plan(std::span<const TileSurface> tiles) {
    tiles_.assign(tiles.size(), {});
    rims_.assign(tiles.size(), {});
    outside_.assign(tiles.size(), 0);
    parallel_(tiles.size(), [&](std::size_t t) {
      const SurfaceErrorInput in = input_of(tiles[t]);
      const proto::TileMesh& mesh = *in.mesh;
      const SampleWindow window(in, mesh.side);
      MeteredTile& tile = tiles_[t];
      tile.facts = tile_facts(in, height_range_m(mesh));
      tile.rows = window.rows();
      tile.row_shift = window.row_shift();
      std::copy(window.stretches().begin(), window.stretches().end(), tile.stretch);
      rims_[t] = Rims(mesh).edges();
      outside_[t] = leaves(mesh, tile);
    });
    vertices_ = triangles_ = edges_ = 0;
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      tiles_[t].first_vertex = static_cast<std::uint32_t>(vertices_);
      tiles_[t].first_triangle = static_cast<std::uint32_t>(triangles_);
      tiles_[t].first_rim = static_cast<std::uint32_t>(edges_);
      tiles_[t].rims = static_cast<std::uint32_t>(rims_[t].size());
      if (outside_[t]) continue;  // nothing of it goes to the device
      vertices_ += tiles[t].mesh->vertices();
      triangles_ += tiles[t].mesh->triangles.size();
      edges_ += rims_[t].size();
    }
  }
  static bool leaves(const proto::TileMesh& mesh, const MeteredTile& tile) {
    const auto holds = [](const Span& span, std::int64_t at) { return at >= span.first && at <= span.last; };
    for (std::size_t v = 0; v < mesh.vertices(); ++v) {
      if (is_void(mesh, v)) continue;
      if (!holds(tile.rows, mesh.y[v])) return true;
      if (!holds(tile.stretch[0].columns, mesh.x[v]) && !holds(tile.stretch[1].columns, mesh.x[v])) return true;
    }
    return false;
  }

  void pack(std::span<const TileSurface> tiles) {
    x_.stage(vertices_), y_.stage(vertices_), height_.stage(vertices_), mark_.stage(vertices_);
    corner_.stage(3 * triangles_), rim_.stage(edges_);
    parallel_(tiles.size(), [&](std::size_t t) {
      if (outside_[t]) return;
      const proto::TileMesh& mesh = *tiles[t].mesh;
      const std::uint32_t first = tiles_[t].first_vertex;
      std::copy(mesh.x.begin(), mesh.x.end(), x_.host.data() + first);
      std::copy(mesh.y.begin(), mesh.y.end(), y_.host.data() + first);
      std::copy(mesh.height.begin(), mesh.height.end(), height_.host.data() + first);
      std::copy(mesh.mark.begin(), mesh.mark.end(), mark_.host.data() + first);
      std::uint32_t* to = corner_.host.data() + 3 * std::size_t{tiles_[t].first_triangle};
      for (const auto& triangle : mesh.triangles) to = std::copy(triangle.begin(), triangle.end(), to);
      std::copy(rims_[t].begin(), rims_[t].end(), rim_.host.data() + tiles_[t].first_rim);
    });
  }

  void load() {
    in_.tile_count = static_cast<std::uint32_t>(tiles_.size());
    in_.x = upload(x_.device, x_.host.data(), vertices_);
    in_.y = upload(y_.device, y_.host.data(), vertices_);
    in_.height = upload(height_.device, height_.host.data(), vertices_);
    in_.mark = upload(mark_.device, mark_.host.data(), vertices_);
    in_.corner = upload(corner_.device, corner_.host.data(), 3 * triangles_);
    in_.rim = upload(rim_.device, rim_.host.data(), edges_);
    in_.published = room(published_, vertices_);
    in_.tile_of = room(tile_of_, triangles_);
    in_.metered = room(metered_, triangles_);
    in_.rows = room(rows_, triangles_ + 1);
    in_.row_start = room(row_start_, triangles_ + 1);
    in_.tally = room(tally_, tiles_.size());
    in_.tall_rows = room(tall_rows_, 1);
    device_->zero(in_.tall_rows, 1);
    device_->zero(in_.tally, tiles_.size());
    device_->zero(in_.published, vertices_);
    device_->zero(in_.rows + triangles_, 1);
    count_valid();
    in_.tiles = upload(device_tiles_, tiles_.data(), tiles_.size());
    TileTally done;
    device_->copy_out(&done, in_.tally, 1);  // so that stages are told apart
  }

  /// A tile that has samples everywhere needs not ask for each of them whether it is one.
  void count_valid() {
    valid_.assign(tiles_.size(), 0);
    if (any_void_) {
      std::vector<std::uint32_t> first;
      std::uint32_t rows = 0;
      for (const MeteredTile& tile : tiles_) {
        first.push_back(rows);
        rows += static_cast<std::uint32_t>(length(tile.rows));
      }
      in_.tiles = upload(device_tiles_, tiles_.data(), tiles_.size());
      device_->each(rows, CountValid{in_, upload(row_first_, first.data(), first.size())});
      std::vector<TileTally> tallies(tiles_.size());
      device_->copy_out(tallies.data(), in_.tally, tallies.size());
      for (std::size_t t = 0; t < tiles_.size(); ++t) valid_[t] = tallies[t].valid;
    } else {
      for (std::size_t t = 0; t < tiles_.size(); ++t) {
        for (const SampleWindow::Stretch& s : tiles_[t].stretch) valid_[t] += length(s.columns) * length(tiles_[t].rows);
      }
    }
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      const std::uint64_t across = static_cast<std::uint64_t>(tiles_[t].facts.side) + 1;
      tiles_[t].all_valid = valid_[t] == across * across;
    }
  }

  /// Empty where there may be too many rows: the host measures them.
  std::vector<TileTally> run() {
    device_->each(triangles_, CountRows{in_});
    device_->exclusive_sum(in_.rows, in_.row_start, triangles_ + 1);
    std::uint32_t rows = 0;
    std::uint64_t tall_rows = 0;
    device_->copy_out(&rows, in_.row_start + triangles_, 1);
    device_->copy_out(&tall_rows, in_.tall_rows, 1);
    if (tall_rows + std::uint64_t{CountRows::kTall} * triangles_ > UINT32_MAX - kRowsAtOnce)
      return {};  // they might not be counted in 32 bits
    for (std::uint32_t begin = 0; begin < rows; begin += kRowsAtOnce)
      measure_rows(begin, std::min(rows - begin, kRowsAtOnce), piece_of(rows));
    constexpr std::uint32_t kStep = Device::kInStep;
    device_->each((vertices_ + kStep - 1) / kStep * kStep, MeasureVertex{in_, static_cast<std::uint32_t>(vertices_)});
    std::vector<TileTally> tallies(tiles_.size());
    device_->copy_out(tallies.data(), in_.tally, tallies.size());
    for (std::size_t t = 0; t < tiles_.size(); ++t) tallies[t].valid = valid_[t];
    return tallies;
  }

  void measure_rows(std::uint32_t begin, std::uint32_t count, std::uint32_t piece) {
    RowRange range{begin,
                   count,
                   piece,
                   room(metered_rows_, count),
                   room(piece_start_, count + 1),
                   room(beyond_, count),
                   room(beyond_count_, 1)};
    device_->zero(range.beyond_count, 1);
    device_->zero(range.piece_start + count, 1);
    device_->each(threads_for(count, PlaceRows::kEach, Device::kInStep),
                  PlaceRows{in_, static_cast<std::uint32_t>(triangles_), range});
    device_->exclusive_sum(range.piece_start, range.piece_start, count + 1);
    std::uint32_t pieces = 0, beyond = 0;
    device_->copy_out(&pieces, range.piece_start + count, 1);
    device_->copy_out(&beyond, range.beyond_count, 1);
    const Scattered order(threads_for(pieces, MeasurePieces::kEach, Device::kInStep), Device::kInStep);
    device_->each(order.threads(), MeasurePieces{in_, range, pieces, order});
    device_->each(beyond, MeasureBeyond{in_, range});
  }

  /// Samples to a piece where there are so many rows: what a piece has to prepare shall pay, and most pieces be full.
  std::uint32_t piece_of(std::uint32_t rows) const {
    std::uint64_t samples = 0;
    for (const std::uint64_t valid : valid_) samples += valid;
    return samples < std::uint64_t{4} * rows ? 4 : 8;
  }

  static SurfaceError error_of(const TileTally& tally) {
    const auto saturated = [](std::uint64_t n) { return static_cast<std::uint32_t>(std::min<std::uint64_t>(n, UINT32_MAX)); };
    SurfaceError error;
    error.max_m = bits_double(tally.max_bits);
    error.sum_squared_m2 = SquareSum{tally.square_low, tally.square_high}.value_m2();
    error.samples = saturated(tally.summed);
    error.uncovered = saturated(tally.valid - tally.covered);
    error.overcovered = saturated(tally.overcovered);
    return error;
  }

  /// An array that is filled on the host and read on the device.
  template <class T>
  struct Sent {
    Staging<T> host;
    Array<T> device;
    void stage(std::size_t count) { host.reserve(std::max<std::size_t>(count, 1)); }
  };

  std::unique_ptr<Device> device_;
  ParallelFor parallel_;
  std::vector<proto::StageTime> stages_;
  proto::StopWatch watch_;

  proto::Lattice lattice_;
  const proto::Samples* samples_ = nullptr;
  std::optional<SampleFrames> frames_;  ///< for what the host measures
  double ecef_step_m_ = 0;
  bool any_void_ = false;
  Array<std::int32_t> heights_;
  Array<proto::RowFrame> row_frames_;
  Array<proto::ColumnFrame> column_frames_;

  MeterArrays in_;
  std::vector<MeteredTile> tiles_;
  std::vector<std::vector<std::uint64_t>> rims_;
  std::vector<std::uint8_t> outside_;  ///< indexed by tile: 1: measured on the host
  std::vector<std::uint64_t> valid_;   ///< indexed by tile: samples
  std::size_t vertices_ = 0, triangles_ = 0, edges_ = 0;
  Sent<std::int32_t> x_, y_, height_;
  Sent<std::uint8_t> mark_;
  Sent<std::uint32_t> corner_;
  Sent<std::uint64_t> rim_;
  Array<MeteredTile> device_tiles_;
  Array<std::uint8_t> published_;
  Array<std::uint32_t> tile_of_, rows_, row_start_, row_first_;
  Array<MeteredTriangle> metered_;
  Array<MeteredRow> metered_rows_;
  Array<std::uint32_t> piece_start_, beyond_, beyond_count_;
  Array<std::uint64_t> tall_rows_;
  Array<TileTally> tally_;
};

}  // namespace cordillera::gpu
