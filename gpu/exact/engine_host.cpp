// The engine on a CPU: loops and windows over threads.
#include <atomic>
#include <mutex>

#include "gpu/device/host_steps.h"
#include "gpu/device/lanes.h"
#include "gpu/exact/engine.inl"
#include "gpu/exact/steps/host_team.h"

namespace cordillera::gpu::exact {
namespace {

struct HostLane : OneLane {
  float coded_error(const Triangle& t, const Field& field, int sx, int sy) const { return eight_coded_error(t, field, sx, sy); }
  void add(ErrorSums& to, const ErrorSums& sums) const {
    __atomic_fetch_add(&to.squares, sums.squares, __ATOMIC_RELAXED);
    __atomic_fetch_add(&to.samples, sums.samples, __ATOMIC_RELAXED);
    std::uint64_t before = __atomic_load_n(&to.max_bits, __ATOMIC_RELAXED);
    while (before < sums.max_bits &&
           !__atomic_compare_exchange_n(&to.max_bits, &before, sums.max_bits, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {}
  }
};

class HostExecutor : public HostSteps {
 public:
  explicit HostExecutor(ParallelFor parallel) : parallel_(std::move(parallel)) {}

  static constexpr std::size_t kMostParts = 1;  ///< of a triangle that is measured

  void use(const std::atomic<bool>* stop) { stop_ = stop; }
  void wait() {}
  template <class T>
  void give_back(Array<T>& array) {
    array = {};
  }
  std::string name() const { return "cpu"; }

  SampleRows rows(Array<std::int32_t>&, const std::int32_t* from, std::int32_t, std::int32_t, std::int64_t stride) {
    return {from, stride};
  }
  template <class T>
  const T* readable(Array<T>&, const T* from, std::size_t) {
    return from;
  }
  template <class F>
  void parallel(std::size_t n, const F& work) {
    parallel_(n, work);
  }
  template <class F>
  void each(std::size_t n, const F& f) {
    in_pieces(n, 8192, [&f](std::size_t i) { f(i); });
  }
  template <class F>
  void each_at(int columns, int rows, const F& f) {
    parallel_(static_cast<std::size_t>(rows), [&f, columns](std::size_t y) {
      for (int x = 0; x < columns; ++x) f(x, static_cast<int>(y));
    });
  }
  template <class F>
  void each_run(std::size_t n, const F& f) {
    in_pieces(n, 32, [&f](std::size_t i) { f(i, HostLane{}); });
  }
  void windows(const PassView& pass, std::uint32_t count) {
    parallel_(count, [&pass, stop = stop_](std::size_t number) {
      if (stop && *stop) return;
      thread_local std::vector<std::uint64_t> storage;
      storage.resize(window_bytes(0) / 8 + 1);
      HostTeam team;
      WindowPass<HostTeam>(team, pass, static_cast<std::uint32_t>(number), reinterpret_cast<unsigned char*>(storage.data()))
          .run();
    });
  }

 private:
  template <class F>
  void in_pieces(std::size_t n, std::size_t piece, const F& f) {
    const std::size_t pieces = (n + piece - 1) / piece;
    if (pieces <= 1) {
      for (std::size_t i = 0; i < n; ++i) f(i);
      return;
    }
    parallel_(pieces, [&](std::size_t p) {
      for (std::size_t i = p * piece; i < n && i < (p + 1) * piece; ++i) f(i);
    });
  }

  ParallelFor parallel_;
  const std::atomic<bool>* stop_ = nullptr;
};

}  // namespace

std::unique_ptr<BlockSimplifier> make_host_engine(ParallelFor parallel) {
  return std::make_unique<Engine<HostExecutor>>(std::make_unique<HostExecutor>(std::move(parallel)));
}

}  // namespace cordillera::gpu::exact
