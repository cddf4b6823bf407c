#pragma once
// The mesh in work and its arrays on a device.
#include <algorithm>
#include <optional>

#include "gpu/fit/fitter.h"
#include "gpu/fit/steps/grid_steps.h"
#include "gpu/fit/steps/mesh_steps.h"
#include "gpu/fit/steps/progress.h"
#include "gpu/fit/steps/steps.h"
#include "gpu/fit/steps/sweep_steps.h"

namespace cordillera::gpu::fit {

template <class Device>
class WorkMesh {
 public:
  template <class T>
  using Array = typename Device::template Array<T>;

  explicit WorkMesh(Device& device) : device_(device) {}

  /// False: some vertex has no single fan.
  bool load(const Plan& plan);
  /// A regular grid, its heights where steps run; sample_z: room for the samples.
  void load(const HeightGrid& grid, const PlanScale& scale, float* sample_z);
  /// Numbers the survivors anew when well under half are left: neighbours come to lie near each other again.
  /// Locks and waves are forgotten then; true if so.
  bool close_up();
  /// More numbers that are gone, for vertices to come: at least so many, or as many as there is memory for.
  void make_room(std::size_t wanted);
  void pack();
  /// What was packed.
  void fetch(FittedMesh& to);

  /// The survivors, ascending; valid until the next call of this or of close_up().
  Vertices alive() {
    std::uint32_t* const list = room(alive_, ids_);
    return {device_.select(ids_, IsAlive{mesh_.vertex}, list), list};
  }

  /// Gives out waves, by wave(progress), until one halts. No fewer triangles than `least` may be left; `enough` are few enough.
  template <class Wave>
  Progress until_halt(std::uint64_t least, std::uint64_t enough, const Wave& wave) {
    Progress start;
    start.triangles = triangles_;
    start.least = least;
    start.enough = enough;
    start.vertices = static_cast<std::uint32_t>(ids_ - removed_);
    start.crowded = static_cast<std::uint32_t>(crowded());
    Progress* const progress = room(progress_, 1);
    device_.copy_in(progress, &start, 1);
    for (auto watch = device_.template watch<Progress>();;) {
      wave(progress);
      const std::optional<Progress> now = watch.look(progress);
      if (!now || now->halt == Halt::none) continue;
      count(std::int64_t{now->vertices} - std::int64_t{start.vertices},
            static_cast<std::int64_t>(now->triangles) - static_cast<std::int64_t>(start.triangles));
      return *now;
    }
  }
  /// For steps that want one though there are no waves.
  Progress* fresh_progress() {
    device_.zero(reinterpret_cast<std::uint32_t*>(room(progress_, 1)), sizeof(Progress) / sizeof(std::uint32_t));
    return progress_.data();
  }

  const FitMesh& mesh() const { return mesh_; }
  const WaveView& wave() const { return wave_; }
  std::size_t ids() const { return ids_; }  ///< vertices are numbered 0..ids-1; some are gone
  std::uint64_t triangles() const { return triangles_; }
  /// Runs of vertex numbers that lie near each other in the plan, as they were loaded; none: nobody knows of any.
  std::size_t blocks() const { return blocks_; }
  const std::uint32_t* block_start() const { return block_start_.data(); }
  /// Samples to a vertex, about.
  std::size_t crowd() const { return samples_ / std::max<std::size_t>(ids_ - removed_, 1); }
  void set_samples(std::size_t count) { samples_ = count; }
  void count(std::int64_t vertices, std::int64_t triangles) {
    removed_ -= static_cast<std::uint64_t>(vertices);
    triangles_ += static_cast<std::uint64_t>(triangles);
  }

  template <class T>
  T* room(Array<T>& array, std::size_t count) {
    array.reserve(count);
    return array.data();
  }
  template <class T>
  T* upload(Array<T>& array, const std::vector<T>& from) {
    T* const to = room(array, from.size());
    device_.copy_in(to, from.data(), from.size());
    return to;
  }

 private:
  static constexpr std::uint32_t kWidestRow = 256;
  static constexpr std::size_t kLeastRoom = 256;

  void make_arrays(std::size_t count);

  /// So few survivors are well under half.
  std::size_t crowded() const { return ids_ * 9 / 20; }

  Device& device_;
  FitMesh mesh_, spare_mesh_;
  WaveView wave_, spare_wave_;
  std::size_t blocks_ = 0, ids_ = 0, samples_ = 0, capacity_ = 0, spare_capacity_ = 0, packed_ = 0;
  std::uint64_t triangles_ = 0, removed_ = 0;
  Array<Vertex> vertex_[2];
  Array<std::uint32_t> rows_[2];
  Array<float> cost_[2];
  Array<Intent> intent_[2];
  Array<std::uint8_t> mark_[2];
  Array<Planes> planes_[2];
  Array<std::uint64_t> lock_;
  Array<std::uint32_t> block_start_, spent_, into_, alive_, number_, wedge_end_, first_;
  Array<Progress> progress_;
  Array<Triangle> triangle_;
  Array<Wedge> wedges_;
  Array<RingFacts> facts_;
  Array<Point> at_;
  Array<float> z_;
};

}  // namespace cordillera::gpu::fit
