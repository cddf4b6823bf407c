#pragma once
// The steps over arrays that every driver needs, on the CPU: one thread, plain loops. A device has:
//   kInStep                                      threads that run in step; 1 on a host
//   Array<T>, Staging<T>                         its memory; host memory that is quickly copied to it. reserve(n), data()
//   copy_in(to, from, n), copy_out(to, from, n)  copy_out returns when the values are there
//   zero(to, n)
//   each(n, f)                                   f(i) for i in 0..n-1, in any order
//   cooperate(n, f)                              f(team), the team as large as n pays for; team.each(n, g), team.barrier()
//   select(n, keep, to)                          the i in 0..n-1 with keep(i), ascending; returns how many
//   exclusive_sum(from, to, n)
//   group(values, group_of, first, to)           values by group, group g from first[g], in their old order within a group
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <span>
#include <vector>

namespace cordillera::gpu {

class HostSteps {
 public:
  static constexpr std::uint32_t kInStep = 1;  ///< threads that run in step

  template <class T>
  class Array {
   public:
    T* data() const { return data_.get(); }
    void reserve(std::size_t count) {
      if (count <= capacity_) return;
      data_.reset();
      data_ = std::make_unique_for_overwrite<T[]>(count);
      capacity_ = count;
    }

   private:
    std::unique_ptr<T[]> data_;
    std::size_t capacity_ = 0;
  };

  template <class T>
  void copy_in(T* to, const T* from, std::size_t n) {
    std::copy(from, from + n, to);
  }
  template <class T>
  void copy_out(T* to, const T* from, std::size_t n) {
    std::copy(from, from + n, to);
  }
  template <class T>
  void zero(T* to, std::size_t n) {
    std::fill(to, to + n, T{});
  }
  template <class F>
  void each(std::size_t n, const F& f) {
    for (std::size_t i = 0; i < n; ++i) f(i);
  }
  template <class Keep>
  std::size_t select(std::size_t n, const Keep& keep, std::uint32_t* to) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (keep(static_cast<std::uint32_t>(i))) to[count++] = static_cast<std::uint32_t>(i);
    }
    return count;
  }
  void exclusive_sum(const std::uint32_t* from, std::uint32_t* to, std::size_t n) { std::exclusive_scan(from, from + n, to, 0u); }
  /// Values by group, in their order within one; first[g]: where group g begins in to.
  void group(std::span<const std::uint32_t> values, const std::uint32_t* group_of, std::span<const std::uint32_t> first,
             std::uint32_t* to) {
    cursor_.assign(first.begin(), first.end());
    for (std::size_t i = 0; i < values.size(); ++i) to[cursor_[group_of[i]]++] = values[i];
  }

 private:
  std::vector<std::uint32_t> cursor_;
};

}  // namespace cordillera::gpu
