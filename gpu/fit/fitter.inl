// The driver of the fit; included by fit_host.cpp and fit_cuda.cu only.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "gpu/fit/collapser.h"
#include "gpu/fit/dropper.h"
#include "gpu/fit/inserter.h"
#include "gpu/fit/relocate_power.h"
#include "gpu/fit/sample_store.h"
#include "gpu/fit/sweeper.h"
#include "gpu/fit/turner.h"
#include "gpu/fit/work_mesh.inl"

namespace cordillera::gpu::fit {

/// One mesh, from its waves to its last sweep.
template <class Device, class Samples>
class Fit {
 public:
  Fit(Device& device, WorkMesh<Device>& work, const Samples& samples, std::size_t sample_count)
      : device_(device),
        work_(work),
        samples_(samples),
        count_(sample_count),
        dropper_(device, work),
        collapser_(device, work, samples),
        sweeper_(device, work),
        turner_(device, work),
        inserter_(device, work) {
    error_.reserve(std::max(count_, std::size_t{1}));
    work_.set_samples(count_);
  }

  /// The lowest sample at which the surface lies over itself.
  std::optional<std::uint32_t> overlap() {
    std::uint32_t* const found = work_.room(found_, 1);
    std::uint32_t sample = 0;
    device_.zero(found, 1);
    device_.each(work_.ids(), FindOverlap<Samples>{work_.mesh(), samples_, found});
    device_.copy_out(&sample, found, 1);
    return sample == 0 ? std::nullopt : std::optional(~sample);
  }

  template <class Stage>
  void to_count(std::uint64_t target, const Recipe& recipe, const Stage& stage) {
    CollapseRules waves = recipe.waves;
    if (recipe.drop_to > 0) waves.has_planes = drop(target, recipe.drop_to);
    if (waves.has_planes) waves.pool = recipe.pool_after_drops;
    stage("drops");
    CollapseRules late = recipe.waves;
    late.cost = CostOf::samples;
    late.pool = recipe.late_pool;
    if (recipe.late_from > 0) {
      collapse(static_cast<std::uint64_t>(recipe.late_from * static_cast<double>(target)), waves);
      stage("waves");
      collapse(target, late);
    } else {
      collapse(target, waves);
    }
    stage("waves");
    sweeps(recipe.sweeps, recipe.flip_rounds);
    stage("sweeps");
    for (int k = 0; k < recipe.exchanges; ++k) exchange(target, recipe);
    stage("exchange");
    if (recipe.lower_maximum) lower_maximum({});
    stage("maximum");
  }

  /// As far as no sample is farther off than the limit. Errors are zero at first; every step keeps to the limit.
  template <class Stage>
  void to_error(float most, const Recipe& recipe, const Stage& stage) {
    const ErrorLimit limit{std::max(0.0f, most * (1 - kRelativeRounding) - kRounding)};
    CollapseRules rules = recipe.waves;
    rules.limit = limit;
    // What carried planes allowed may have become too far off when its turn comes: only the shape is asked for again then.
    if (rules.cost == CostOf::carried_planes) rules.cost = CostOf::planes;
    if (recipe.late_from > 0) rules.cost = CostOf::samples;
    collapse(0, rules);
    stage("waves");
    rules.cost = CostOf::samples;
    for (int k = 0; k < recipe.sweeps; ++k) {
      sweeper_.sweep(Relocate<Samples>{work_.mesh(), samples_, kTries, limit});
      lower_maximum(limit);
      turner_.pass(samples_, recipe.flip_rounds, limit);
      stage("sweeps");
      collapse(0, rules);
      stage("waves");
    }
  }

  void measure(std::vector<float>& error) {
    error.resize(count_);
    device_.zero(error_.data(), count_);
    device_.each_star({work_.ids()}, work_.crowd(), MeasureErrors<Samples>{work_.mesh(), samples_, error_.data()});
    device_.copy_out(error.data(), error_.data(), count_);
  }

 private:
  static constexpr int kTries = 2;
  /// Drops spare this share of the triangles: what comes below takes little time, and shows most.
  static constexpr double kNoDrops = 0.1;
  /// Of scaled heights as floats: the promise is about the input's own.
  static constexpr float kRounding = 2.5e-4f, kRelativeRounding = 1e-5f;

  /// False: there is no need.
  bool drop(std::uint64_t target, double drop_to) {
    const auto all = static_cast<double>(work_.triangles());
    const double least = std::max(static_cast<double>(target), kNoDrops * all);
    if (all <= drop_to * least) return false;
    dropper_.drop(static_cast<std::uint64_t>(drop_to * least), static_cast<std::uint64_t>(least));
    return true;
  }
  void collapse(std::uint64_t target, const CollapseRules& rules) { collapser_.collapse(target, rules, error_.data(), count_); }

  void sweeps(int count, int flip_rounds) {
    for (int k = 0; k < count; ++k) {
      if (k > 0) turner_.pass(samples_, flip_rounds, {});
      sweeper_.sweep(Relocate<Samples>{work_.mesh(), samples_, kTries, {}});
    }
  }

  /// The vertices that cost least go, the samples that are farthest off come in.
  void exchange(std::uint64_t target, const Recipe& recipe) {
    CollapseRules rules = recipe.waves;
    rules.cost = CostOf::samples;
    rules.pool = recipe.exchange_pool;
    rules.first_look = recipe.exchange_look;
    collapse(target - static_cast<std::uint64_t>(recipe.exchange_share * static_cast<double>(target)), rules);
    inserter_.insert(samples_, target);
    if (work_.triangles() + 1 == target) {  // one is missing: one more goes, along the border, and two come
      collapse(target - 2, rules);
      inserter_.insert(samples_, target);
    }
    for (int k = 0; k < recipe.exchange_sweeps; ++k) {
      turner_.pass(samples_, recipe.flip_rounds, {});
      sweeper_.sweep(Relocate<Samples>{work_.mesh(), samples_, kTries, {}});
    }
  }

  void lower_maximum(ErrorLimit limit) {
    std::vector<float> error;
    for (const auto& [power, sweeps] : {std::pair{8, 3}, std::pair{16, 2}}) {
      measure(error);
      float worst = 0;
      for (const float e : error) worst = std::max(worst, std::abs(e));
      if (!(worst > 0)) return;
      for (int k = 0; k < sweeps; ++k) sweeper_.sweep(RelocateByPower<Samples>{work_.mesh(), samples_, 1 / worst, power, limit});
    }
  }

  Device& device_;
  WorkMesh<Device>& work_;
  Samples samples_;
  std::size_t count_;
  Dropper<Device> dropper_;
  Collapser<Device, Samples> collapser_;
  Sweeper<Device> sweeper_;
  Turner<Device> turner_;
  Inserter<Device> inserter_;
  typename Device::template Array<float> error_;
  typename Device::template Array<std::uint32_t> found_;
};

template <class Device>
class Fitter final : public FitEngine {
 public:
  explicit Fitter(std::unique_ptr<Device> device) : device_(std::move(device)), work_(*device_), store_(*device_) {}

  FittedMesh fit(const Plan& plan, const FitRequest& request) override {
    begin();
    if (!work_.load(plan)) return faulty(FittedMesh::Fault::not_manifold, 0);
    if (plan.is_lattice()) return fit(store_.lattice(plan, work_), plan.lattice_z.size(), request, true);
    return fit(store_.scattered(plan, work_), plan.z.size(), request, true);
  }

  FittedMesh fit(const HeightGrid& from, FitRequest request, PlanScale& scale) override {
    begin();
    const std::size_t count = std::size_t{from.columns} * from.rows;
    HeightGrid grid = from;
    grid.z = heights_of(from);
    HeightFacts facts, *const found = work_.room(facts_, 1);
    device_->zero(reinterpret_cast<std::uint32_t*>(found), sizeof(facts) / sizeof(std::uint32_t));
    device_->each(count, FindHeights{grid.z, found});
    device_->copy_out(&facts, found, 1);
    if (facts.bad != 0) return faulty(FittedMesh::Fault::not_finite, ~facts.bad);
    scale.set_heights(unordered(~facts.low), unordered(facts.high));
    request.error = static_cast<float>(request.error_m * scale.scale_z);
    work_.load(grid, scale, store_.grid_room(count, work_));
    return fit(store_.grid(grid, work_), count, request, false);
  }

  const float* keep(const HeightGrid& grid) override {
    device_->use();
    const std::size_t count = std::size_t{grid.columns} * grid.rows;
    device_->copy_in(work_.room(kept_, count), grid.z, count);
    return kept_.data();
  }

  std::string device() const override { return device_->name(); }
  const std::vector<proto::StageTime>& stages() const override { return stages_; }

 private:
  void begin() {
    device_->use();
    device_->forget_stamps();
    stages_.clear();
    ended_.clear();
    start_ = device_->stamp();
  }
  static FittedMesh faulty(FittedMesh::Fault fault, std::uint32_t sample) {
    FittedMesh result;
    result.fault = fault;
    result.fault_sample = sample;
    return result;
  }
  const float* heights_of(const HeightGrid& grid) {
    if (grid.on_device) return grid.z;
    const std::size_t count = std::size_t{grid.columns} * grid.rows;
    device_->copy_in(work_.room(heights_, count), grid.z, count);
    return heights_.data();
  }

  template <class Samples>
  FittedMesh fit(const Samples& samples, std::size_t sample_count, const FitRequest& request, bool may_overlap) {
    Fit<Device, Samples> fit(*device_, work_, samples, sample_count);
    const auto in_stage = [this](const char* name) { ended_.push_back({name, device_->stamp()}); };
    if (may_overlap) {
      if (const auto sample = fit.overlap()) return faulty(FittedMesh::Fault::overlap, *sample);
    }
    in_stage("load");
    if (request.by_error)
      fit.to_error(request.error, request.recipe, in_stage);
    else
      fit.to_count(request.triangles, request.recipe, in_stage);
    FittedMesh result;
    work_.pack();
    in_stage("pack");
    work_.fetch(result);
    in_stage("fetch");
    sum_up_stages();
    fit.measure(result.error);
    return result;
  }

  void sum_up_stages() {
    std::size_t from = start_;
    for (const auto& [name, to] : ended_) {
      proto::add_time(stages_, name, device_->seconds_between(from, to));
      from = to;
    }
  }

  std::unique_ptr<Device> device_;
  WorkMesh<Device> work_;
  SampleStore<Device> store_;
  std::vector<proto::StageTime> stages_;
  std::vector<std::pair<std::string, std::size_t>> ended_;
  std::size_t start_ = 0;
  typename Device::template Array<float> heights_, kept_;
  typename Device::template Array<HeightFacts> facts_;
};

}  // namespace cordillera::gpu::fit
