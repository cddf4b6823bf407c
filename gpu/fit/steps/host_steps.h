#pragma once
// The steps of the driver (see fitter.h) on the CPU, by as many threads as there are. Which thread does what does not show.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "gpu/device/atomic.h"
#include "gpu/device/host_steps.h"
#include "gpu/fit/steps/crew.h"
#include "gpu/fit/steps/lanes.h"
#include "gpu/fit/steps/steps.h"

namespace cordillera::gpu::fit {

/// The team of a block: one thread.
struct OneThread {
  template <class F>
  void each(std::size_t n, const F& f) {
    for (std::size_t i = 0; i < n; ++i) f(i);
  }
  void barrier() {}
};

class HostSteps : public gpu::HostSteps {
 public:
  explicit HostSteps(unsigned threads) : crew_(threads) {}

  void use() { works_alone = crew_.threads() == 1; }
  std::string name() const { return "cpu"; }

  template <class F>
  void each(Count n, const F& f) {
    share(n.value(), kManyItems, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) f(i);
    });
  }
  template <class F>
  void each_of(Vertices vertices, const F& f) {
    each(vertices.count, [&](std::size_t i) { f(vertices[i]); });
  }
  template <class F>
  void each_star(Vertices vertices, std::size_t, const F& f) {
    share(vertices.count.value(), kManyStars, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) f(OneLane{}, vertices[i]);
    });
  }
  template <class F>
  void each_edge(Vertices vertices, std::size_t crowd, const F& f) {
    each_star(vertices, crowd, f);
  }
  template <class F>
  void each_block(std::size_t blocks, const F& f) {
    crew_.share(blocks, [&](std::size_t block) {
      OneThread team;
      f(team, block);
    });
  }
  template <class F>
  void each_counting(std::size_t n, const F& f) {
    for (std::size_t i = 0; i < n; ++i) f(i);
  }

  std::size_t value(Count count) const { return count.value(); }

  template <class Keep>
  std::size_t select(std::size_t n, const Keep& keep, std::uint32_t* to) {
    return list({n}, keep, to).count.value();
  }
  template <class Keep>
  Vertices list(Vertices from, const Keep& keep, std::uint32_t* to) {
    return split(from, keep, to, nullptr).yes;
  }
  /// Chunks part their own piece of the scratch, from both ends; then the pieces are put together.
  template <class Test>
  Split split(Vertices from, const Test& test, std::uint32_t* yes, std::uint32_t* no) {
    const std::size_t n = from.count.value(), size = chunk_size(n, kManyItems), chunks = chunks_of(n, size);
    if (chunks <= 1) return split_alone(from, n, test, yes, no);
    scratch_.reserve(n);
    found_.assign(chunks, 0);
    crew_.share(chunks, [&](std::size_t chunk) {
      const std::size_t begin = chunk * size, end = std::min(n, begin + size);
      std::uint32_t *low = scratch_.data() + begin, *high = scratch_.data() + end;
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t v = from[i];
        if (test(v))
          *low++ = v;
        else if (no)
          *--high = v;
      }
      found_[chunk] = static_cast<std::size_t>(low - scratch_.data()) - begin;
    });
    first_.assign(chunks, 0);
    for (std::size_t chunk = 1; chunk < chunks; ++chunk) first_[chunk] = first_[chunk - 1] + found_[chunk - 1];
    crew_.share(chunks, [&](std::size_t chunk) {
      const std::size_t begin = chunk * size, end = std::min(n, begin + size);
      const std::uint32_t* const part = scratch_.data() + begin;
      std::copy(part, part + found_[chunk], yes + first_[chunk]);
      if (no) std::reverse_copy(part + found_[chunk], part + (end - begin), no + (begin - first_[chunk]));
    });
    const std::size_t count = first_.back() + found_.back();
    return {{count, yes}, {no ? n - count : 0, no}};
  }

  /// bins[class_of(i)] += 1
  template <class ClassOf>
  void histogram(std::size_t n, const ClassOf& class_of, std::uint32_t* bins, std::size_t classes) {
    const std::size_t chunks = std::min<std::size_t>(crew_.threads(), n / kManyItems + 1), size = (n + chunks - 1) / chunks;
    std::vector<std::vector<std::uint32_t>> counts(chunks);
    crew_.share(chunks, [&](std::size_t chunk) {
      std::vector<std::uint32_t>& count = counts[chunk];
      count.assign(classes + 1, 0);
      for (std::size_t i = chunk * size; i < std::min(n, (chunk + 1) * size); ++i) ++count[class_of(i)];
    });
    for (const std::vector<std::uint32_t>& count : counts) {
      for (std::size_t k = 0; k < classes; ++k) bins[k] += count[k];
    }
  }

  void sort_by_key(std::uint64_t* keys, std::uint32_t* values, std::size_t n) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> pairs(n);
    for (std::size_t i = 0; i < n; ++i) pairs[i] = {keys[i], values[i]};
    std::sort(pairs.begin(), pairs.end());
    for (std::size_t i = 0; i < n; ++i) std::tie(keys[i], values[i]) = pairs[i];
  }

  std::size_t stamp() {
    stamps_.push_back(Clock::now());
    return stamps_.size() - 1;
  }
  double seconds_between(std::size_t from, std::size_t to) const {
    return std::chrono::duration<double>(stamps_[to] - stamps_[from]).count();
  }
  void forget_stamps() { stamps_.clear(); }

  /// A host always knows how things stand.
  template <class T>
  struct Watch {
    std::optional<T> look(const T* at) { return *at; }
  };
  template <class T>
  Watch<T> watch() {
    return {};
  }

 private:
  using Clock = std::chrono::steady_clock;

  static constexpr std::size_t kManyItems = 1024, kManyStars = 64;  ///< fewer are not worth another thread

  std::size_t chunk_size(std::size_t n, std::size_t least) const {
    if (crew_.threads() == 1) return std::max<std::size_t>(n, 1);
    constexpr std::size_t kChunksEach = 8;
    return std::max(least, n / (crew_.threads() * kChunksEach) + 1);
  }
  static std::size_t chunks_of(std::size_t n, std::size_t size) { return (n + size - 1) / size; }

  template <class F>
  void share(std::size_t n, std::size_t least, const F& f) {
    const std::size_t size = chunk_size(n, least), chunks = chunks_of(n, size);
    if (chunks <= 1) return f(0, n);
    crew_.share(chunks, [&](std::size_t chunk) { f(chunk * size, std::min(n, (chunk + 1) * size)); });
  }

  template <class Test>
  static Split split_alone(Vertices from, std::size_t n, const Test& test, std::uint32_t* yes, std::uint32_t* no) {
    std::size_t count = 0, others = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint32_t v = from[i];
      if (test(v))
        yes[count++] = v;
      else if (no)
        no[others++] = v;
    }
    return {{count, yes}, {others, no}};
  }

  Crew crew_;
  std::vector<Clock::time_point> stamps_;
  Array<std::uint32_t> scratch_;
  std::vector<std::size_t> found_, first_;
};

}  // namespace cordillera::gpu::fit
