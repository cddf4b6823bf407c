#pragma once
// The windows of a pass: N candidates at a time, lock-down, tests, collapse (section 4.1's steps 3 and 4), until the target is
// reached or the pool is used up.
#include <vector>

#include "gpu/cleap/integrity_tests.h"
#include "gpu/cleap/lock_down.h"
#include "gpu/cleap/phases.h"

namespace cordillera::gpu::cleap {

/// What is left to do, in collapses or in triangles.
struct Goal {
  CollapseTarget target;
  std::uint64_t triangles = 0;  ///< that there are
  std::uint64_t collapses = 0;  ///< done

  std::uint64_t left() const {
    if (target.collapses > 0) return target.collapses > collapses ? target.collapses - collapses : 0;
    return triangles > target.triangles ? (triangles - target.triangles + 1) / 2 : 0;
  }
};

template <class Device>
class Windows {
  template <class T>
  using Array = typename Device::template Array<T>;

 public:
  Windows(Device& device, const Options& options, Report& report) : device_(device), options_(options), report_(report) {}

  /// A pass over a pool of a mesh.
  template <class Metric>
  void run(const Arrays& mesh, const std::uint32_t* pool, std::uint32_t size, Goal& goal) {
    mesh_ = mesh;
    const std::uint32_t width = options_.window > 0 ? options_.window : std::max(size, 1u);
    make_room(std::min(width, std::max(size, 1u)));
    Window window = empty_window(pool);
    while (goal.left() > 0 && (window.next < size || window.queued > 0)) {
      const std::uint32_t ahead = std::max<std::uint32_t>(1, std::min(windows_ahead(goal, width), (size - window.next) / width));
      std::uint32_t* const tally = room(tally_, kMostAhead * kFates);
      device_.zero(tally, ahead * kFates);
      for (std::uint32_t k = 0; k < ahead; ++k) {
        window.count = std::min(width, window.queued + (size - window.next));
        const std::uint32_t most = window.count > goal.left() ? static_cast<std::uint32_t>(goal.left()) : window.count;
        step<Metric>(window, tally + k * kFates, most);
        window.next += window.count - std::min(window.queued, window.count);
        if (options_.come_back) queue_again(window);
      }
      take_stock(tally, ahead, goal);
    }
    report_phases();
  }

 private:
  static constexpr std::uint32_t kMostAhead = 64;
  enum Phase { kLoad, kLock, kTest, kCount, kEliminate, kTriangles, kEdges, kConnect, kAround, kPhases };

  void make_room(std::uint32_t width) {
    room(fate_, width);
    room(edge_, width);
    room(to_, width);
    room(left_, std::size_t{3} * width);
    if (mesh_.tag) room(tag_, width);
    room(going_, width);
    room(before_, width);
    for (auto& queue : queue_) room(queue, width);
  }
  Window empty_window(const std::uint32_t* pool) const {
    Window window;
    window.pool = pool;
    window.queue = queue_[0].data();
    window.fate = fate_.data();
    window.edge = edge_.data();
    window.to = to_.data();
    window.left = left_.data();
    window.tag = tag_.data();
    return window;
  }
  /// So many windows cannot pass the target, whatever becomes of them: nobody need look in between.
  std::uint32_t windows_ahead(const Goal& goal, std::uint32_t width) const {
    if (options_.come_back) return 1;
    const std::uint64_t left = is_begun() ? goal.left() : std::min(goal.left(), options_.around_first - report_.collapses);
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(kMostAhead, left / width));
  }

  template <class Metric>
  void step(const Window& window, std::uint32_t* tally, std::uint32_t most) {
    const std::size_t n = window.count;
    const TestCandidate test{mesh_, window, options_.border, options_.most_triangles, options_.inversion};
    begin_phases();
    device_.each(n, LoadCandidate<Metric>{mesh_, window, options_.border});
    end_phase(kLoad);
    if (options_.order == Order::test_first) device_.each(n, test);
    end_phase(kTest);
    lock(window);
    end_phase(kLock);
    if (options_.order == Order::lock_first) device_.each(n, test);
    end_phase(kTest);
    device_.each(n, Release{mesh_, window, options_.closing});
    end_phase(kLock);
    if (most < n) cut(window, most);
    device_.histogram(n, FateOf{window.fate}, tally, kFates);
    end_phase(kCount);
    device_.each(n, Eliminate{mesh_, window});
    end_phase(kEliminate);
    repair(window);
  }

  void lock(const Window& window) {
    if (options_.lock == Lock::raced) {
      device_.each(window.count, LockRaced{mesh_, window});
    } else {
      device_.each(window.count, ClaimOrdered{mesh_, window});
      device_.each(window.count, DecideOrdered{mesh_, window});
    }
  }

  bool is_begun() const { return report_.collapses >= options_.around_first; }
  void repair(const Window& window) {
    if (options_.repair == Repair::around || !is_begun()) {
      device_.each(window.count, RepairAround{mesh_, window});
      return end_phase(kAround);
    }
    device_.each(mesh_.triangles, RepairTriangle{mesh_});
    end_phase(kTriangles);
    device_.each(mesh_.edges, RepairEdge{mesh_});
    end_phase(kEdges);
    device_.each(mesh_.triangles, RepairConnection{mesh_});
    end_phase(kConnect);
  }

  /// The first in the window go; the published program passed its targets by one or two.
  void cut(const Window& window, std::uint32_t most) {
    device_.each(window.count, MarkGoing{window.fate, going_.data()});
    device_.exclusive_sum(going_.data(), before_.data(), window.count);
    device_.each(window.count, CutSurplus{window.fate, before_.data(), most});
  }

  /// Those who lost the lock-down are the first of the next window.
  void queue_again(Window& window) {
    const std::size_t count = device_.select(window.count, WasLocked{window.fate}, going_.data());
    device_.each(count, PlaceInPool{with_next_before(window), going_.data(), queue_[1].data()});
    std::swap(queue_[0], queue_[1]);
    window.queue = queue_[0].data();
    window.queued = static_cast<std::uint32_t>(count);
  }
  /// As it was when the window was loaded.
  static Window with_next_before(Window window) {
    window.next -= window.count - std::min(window.queued, window.count);
    return window;
  }

  void take_stock(const std::uint32_t* tally, std::uint32_t windows, Goal& goal) {
    std::vector<std::uint32_t> found(windows * kFates);
    device_.copy_out(found.data(), tally, found.size());
    for (std::uint32_t k = 0; k < windows; ++k) {
      const std::uint32_t* const fates = found.data() + k * kFates;
      for (std::size_t fate = 0; fate < kFates; ++fate) report_.fates[fate] += fates[fate];
      goal.collapses += fates[0] + fates[1];
      goal.triangles -= 2 * std::uint64_t{fates[0]} + fates[1];
      if (options_.each_window) report_.window_collapses.push_back(fates[0] + fates[1]);
    }
    report_.iterations += windows;
    report_.collapses = goal.collapses;
    sum_phases();
    if (options_.progress) options_.progress(goal.collapses, goal.collapses + goal.left());
  }

  void begin_phases() {
    if (options_.time_phases) stamps_.push_back({kPhases, device_.stamp()});
  }
  void end_phase(Phase phase) {
    if (options_.time_phases) stamps_.push_back({phase, device_.stamp()});
  }
  void sum_phases() {
    for (std::size_t k = 1; k < stamps_.size(); ++k) {
      if (stamps_[k].phase != kPhases) seconds_[stamps_[k].phase] += device_.seconds_between(stamps_[k - 1].at, stamps_[k].at);
    }
    stamps_.clear();
    device_.forget_stamps();
  }
  void report_phases() {
    if (!options_.time_phases) return;
    static constexpr const char* kNames[kPhases] = {"candidates",  "lock-down",           "integrity tests",
                                                    "count",       "elimination",         "triangle repair",
                                                    "edge repair", "connectivity repair", "repair around"};
    report_.phases.clear();
    for (int phase = 0; phase < kPhases; ++phase) {
      if (seconds_[phase] > 0) report_.phases.push_back({kNames[phase], seconds_[phase]});
    }
  }

  struct Stamp {
    Phase phase;
    std::size_t at;
  };

  Device& device_;
  const Options& options_;
  Report& report_;
  Arrays mesh_;
  Array<Fate> fate_;
  Array<std::int32_t> edge_, left_;
  Array<Position> to_;
  Array<Tag> tag_;
  Array<std::uint32_t> going_, before_, queue_[2], tally_;
  std::vector<Stamp> stamps_;
  double seconds_[kPhases] = {};
};

}  // namespace cordillera::gpu::cleap
