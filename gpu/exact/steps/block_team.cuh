#pragma once
// The team of a device: a block of threads. Eight lanes measure a triangle; what squares do not decide goes to a queue that all
// share, so that a large triangle does not keep a few threads busy while the others wait. See window_pass.h.
#include "gpu/exact/steps/coded.h"
#include "gpu/exact/steps/collapse.h"
#include "gpu/exact/steps/heights.h"

namespace cordillera::gpu::exact {

inline constexpr unsigned kGroup = 8;  ///< lanes
inline constexpr int kGroupsAtMost = 64;
inline constexpr int kRoundsOfGroups = 4;  ///< that evaluate vertices, before a thread each takes less time

/// Eight neighbouring lanes, which meet often.
struct Group {
  unsigned lane, leader, mask;
  __device__ Group()
      : lane(threadIdx.x & (kGroup - 1)), leader(threadIdx.x & 31u & ~(kGroup - 1)), mask(((1u << kGroup) - 1) << leader) {}
  __device__ int from_leader(int value) const { return __shfl_sync(mask, value, static_cast<int>(leader)); }
  __device__ bool any(bool value) const { return __any_sync(mask, value) != 0; }
  // As AloneLane has them.
  __device__ int index() const { return static_cast<int>(lane); }
  __device__ int count() const { return static_cast<int>(kGroup); }
  __device__ void take_least(float& cost, int& slot) const {
    for (unsigned o = kGroup / 2; o; o /= 2) {
      const float other = __shfl_xor_sync(mask, cost, static_cast<int>(o));
      const int other_slot = __shfl_xor_sync(mask, slot, static_cast<int>(o));
      if (other_slot >= 0 && (slot < 0 || other < cost || (other == cost && other_slot < slot))) cost = other, slot = other_slot;
    }
  }
  __device__ void take_last(int k, float& value) const {
    for (unsigned o = kGroup / 2; o; o /= 2) {
      const int other_k = __shfl_xor_sync(mask, k, static_cast<int>(o));
      const float other = __shfl_xor_sync(mask, value, static_cast<int>(o));
      if (other_k > k) k = other_k, value = other;
    }
  }
  __device__ int sum(int value) const {
    for (unsigned o = kGroup / 2; o; o /= 2) value += __shfl_xor_sync(mask, value, static_cast<int>(o));
    return value;
  }
};

/// A square that has not decided: of which triangle, where.
struct Undecided {
  int i, k, tier, x, y;
  __device__ static Undecided unpack(std::uint64_t bits) {
    return {static_cast<int>(bits & 0xffff), static_cast<int>(bits >> 16 & 15), static_cast<int>(bits >> 20 & 7),
            static_cast<int>(bits >> 24 & 0xffff), static_cast<int>(bits >> 40 & 0xffff)};
  }
  __device__ std::uint64_t pack() const {
    return static_cast<std::uint64_t>(i) | static_cast<std::uint64_t>(k) << 16 | static_cast<std::uint64_t>(tier) << 20 |
           static_cast<std::uint64_t>(x) << 24 | static_cast<std::uint64_t>(y) << 40;
  }
};

class BlockTeam {
 public:
  template <class F>
  __device__ void each(int n, const F& f) {
    for (int i = static_cast<int>(threadIdx.x); i < n; i += static_cast<int>(blockDim.x)) f(i);
  }
  template <class F>
  __device__ void each_open(const WindowView&, int n, const F& f) {
    each(n, f);
  }
  __device__ void sync() { __syncthreads(); }
  __device__ std::int32_t place(std::int32_t* counter) { return atomicAdd(counter, 1); }

  /// Many vertices: a thread each. A few: eight lanes each, since all others wait for the slowest.
  __device__ void evaluate(const WindowView& w, int n) {
    const int groups = static_cast<int>(blockDim.x / kGroup);
    if (n > kRoundsOfGroups * groups) {
      each(n, [&w](int i) { exact::evaluate(w, w.to_evaluate(i), AloneLane{}); });
      return;
    }
    const Group group;
    for (int i = static_cast<int>(threadIdx.x / kGroup); i < n; i += groups) exact::evaluate(w, w.to_evaluate(i), group);
  }

  /// Depth first, by all threads at once: the newest squares are looked at first, new triangles only while there is room for
  /// theirs.
  template <class Work>
  __device__ void measure(const WindowView& w, const Field& field, int n, const Work& work) {
    if (n == 0) return;
    prepare(w, n, work);
    const int looks = n * w.counter(kMostTriangles);
    for (bool more = true; more;) {
      first_look(w, field, n, work);
      __syncthreads();
      while (look_closer(w, field, work)) {}
      more = w.counter(kTicket) < looks;
      __syncthreads();  // all have read it before the first takes another
    }
  }

  template <class Work>
  __device__ void pull(const WindowView& w, const Field& field, int n, const Work& work) {
    prepare(w, n, work);
    const Group group;
    for (int item; (item = take(w, group, n * w.counter(kMostTriangles))) >= 0;) {
      const int i = item % n, k = item / n;
      if (k >= work.count(i)) continue;
      const PullBox box = work.box(i, k);
      Pull sums;
      int row = static_cast<int>(group.lane) / box.columns, column = static_cast<int>(group.lane) - row * box.columns;
      const int rows_on = static_cast<int>(kGroup) / box.columns, columns_on = static_cast<int>(kGroup) - rows_on * box.columns;
#pragma unroll 4
      for (int q = static_cast<int>(group.lane); q < box.count; q += static_cast<int>(kGroup)) {
        box.add(field, column, row, sums);
        row += rows_on, column += columns_on;
        if (column >= box.columns) column -= box.columns, ++row;
      }
      sums.sum = group.sum(sums.sum);
      sums.weight = group.sum(sums.weight);
      if (group.lane == 0 && (sums.sum != 0 || sums.weight != 0)) {  // samples far from the vertex have a sum, and no weight
        atomicAdd(&w.pull(work.vertex(i)), sums.sum);
        atomicAdd(&w.pull_weight(work.vertex(i)), sums.weight);
      }
    }
    __syncthreads();
  }

 private:
  template <class Work>
  __device__ void prepare(const WindowView& w, int n, const Work& work) {
    if (threadIdx.x == 0) w.counter(kTicket) = w.counter(kMostTriangles) = w.counter(kStacked) = 0;
    __syncthreads();
    each(n, [&](int i) { atomicMax(&w.counter(kMostTriangles), work.count(i)); });
    __syncthreads();
  }
  /// The next piece of work of a group; -1: there is none.
  __device__ int take(const WindowView& w, const Group& group, int count) {
    int item = count;
    if (group.lane == 0 && *static_cast<volatile std::int32_t*>(&w.counter(kStacked)) <= kRoomForFirst)
      item = atomicAdd(&w.counter(kTicket), 1);
    item = group.from_leader(item);
    return item < count ? item : -1;
  }
  static constexpr int kMoreThanOne = 15;  // parts a square
  static constexpr int kRoomForOne = kMoreThanOne * (kTiers - 1);
  static constexpr int kRoomForFirst = kStackLength - kRoomForOne - kGroupsAtMost * kMostFirstSquares;
  static_assert(kRoomForFirst > 0);
  /// All first triangles first, so that most failures are known early.
  template <class Work>
  __device__ void first_look(const WindowView& w, const Field& field, int n, const Work& work) {
    const Group group;
    for (int item; (item = take(w, group, n * w.counter(kMostTriangles))) >= 0;) {
      const int i = item % n, k = item / n;
      if (group.from_leader(k >= work.count(i) || (group.lane == 0 && work.has_failed(i)))) continue;
      const Triangle t = work.triangle(i, k);
      bool fits = can_fit(t);
      if (fits && field.height && is_small(t))
        fits = small_fits(group, t, field);
      else if (fits)
        look_at_squares(w, group, t, field, i, k);
      if (group.any(!fits) && group.lane == 0) work.fail(i);
    }
  }
  __device__ static bool small_fits(const Group& group, const Triangle& t, const Field& field) {
    const int columns = t.east - t.west + 1, count = columns * (t.north - t.south + 1);
    int row = static_cast<int>(group.lane) / columns, column = static_cast<int>(group.lane) - row * columns;
    const int rows_on = static_cast<int>(kGroup) / columns, columns_on = static_cast<int>(kGroup) - rows_on * columns;
    bool fits = true;
#pragma unroll 4
    for (int q = static_cast<int>(group.lane); q < count; q += static_cast<int>(kGroup)) {
      const int x = t.west + column, y = t.south + row;
      const std::uint32_t at = field.index(x, y);  // read in any case: what is waited for is the first of all reads
      fits &= sample_fits(t, field.height[at], field.depth ? field.depth[at] : Depth{0}, x, y) | !t.covers(x, y);
      row += rows_on, column += columns_on;
      if (column >= columns) column -= columns, ++row;
    }
    return fits;
  }
  __device__ static void look_at_squares(const WindowView& w, const Group& group, const Triangle& t, const Field& field, int i,
                                         int k) {
    const int tier = first_tier(t);
    const SquareRange range = squares_under(t, tier);
    const int columns = range.east - range.west + 1, count = columns * (range.north - range.south + 1);
    for (int q = static_cast<int>(group.lane); q < count; q += static_cast<int>(kGroup)) {
      const int x = range.west + q % columns, y = range.south + q / columns;
      if (!square_fits(t, field, tier, x, y)) push(w, {i, k, tier, x, y});
    }
  }
  /// A square waits for a closer look.
  __device__ static void push(const WindowView& w, const Undecided& square) {
    w.stacked(atomicAdd(&w.counter(kStacked), 1)) = square.pack();
  }
  /// Takes a square a group from the stack; fewer where the stack is so full that it might not hold their parts. One at a time
  /// needs room for its parts, a part's parts and so on down to samples. False: the stack was empty.
  template <class Work>
  __device__ bool look_closer(const WindowView& w, const Field& field, const Work& work) {
    const int groups = static_cast<int>(blockDim.x / kGroup), own = static_cast<int>(threadIdx.x / kGroup);
    const int waiting = w.counter(kStacked);
    const int taken = least(least(groups, waiting), greatest((kStackLength - kRoomForOne - waiting) / kMoreThanOne, 1));
    const std::uint64_t bits = own < taken ? w.stacked(waiting - 1 - own) : 0;
    __syncthreads();
    if (waiting == 0) return false;
    if (threadIdx.x == 0) w.counter(kStacked) = waiting - taken;
    __syncthreads();
    if (own < taken) look_at(w, field, work, Undecided::unpack(bits));
    __syncthreads();
    return true;
  }
  template <class Work>
  __device__ void look_at(const WindowView& w, const Field& field, const Work& work, const Undecided& square) {
    const Group group;
    if (group.from_leader(group.lane == 0 && work.has_failed(square.i))) return;
    const Triangle t = work.triangle(square.i, square.k);
    bool fits = true;
    if (square.tier == 0 && !field.height) {
      const int y = 8 * square.y + static_cast<int>(group.lane);
      fits = y < t.south || y > t.north || coded_row_fits(less_code_error(t, field, square.x, square.y), field, square.x, y);
    } else if (square.tier == 0) {
      fits = row_fits(t, field, 8 * square.x, 8 * square.y + static_cast<int>(group.lane));
    } else {
      const SquareRange parts = parts_under(t, square.tier, square.x, square.y);
      for (int q = static_cast<int>(group.lane); q < 16; q += static_cast<int>(kGroup)) {
        const int x = 4 * square.x + (q & 3), y = 4 * square.y + (q >> 2);
        if (x < parts.west || x > parts.east || y < parts.south || y > parts.north) continue;
        if (!square_fits(t, field, square.tier - 1, x, y)) push(w, {square.i, square.k, square.tier - 1, x, y});
      }
    }
    if (group.any(!fits) && group.lane == 0) work.fail(square.i);
  }
  /// Eight samples of a row; rows are padded to whole squares, so all eight may be read.
  __device__ static bool row_fits(const Triangle& t, const Field& field, int x, int y) {
    if (y < t.south || y > t.north) return true;
    const std::uint32_t at = field.index(x, y);
    const float4 west = *reinterpret_cast<const float4*>(field.height + at),
                 east = *reinterpret_cast<const float4*>(field.height + at + 4);
    const float height[8] = {west.x, west.y, west.z, west.w, east.x, east.y, east.z, east.w};
    bool fits = true;
#pragma unroll
    for (int k = 0; k < 8; ++k) {
      fits &= sample_fits(t, height[k], field.depth ? field.depth[at + static_cast<unsigned>(k)] : Depth{0}, x + k, y) |
              !t.covers(x + k, y);
    }
    return fits;
  }
};

}  // namespace cordillera::gpu::exact
