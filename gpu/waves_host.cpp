#include <algorithm>
#include <memory>
#include <numeric>

#include "gpu/host_team.h"
#include "gpu/waves.inl"

namespace cordillera::gpu {
namespace {

class HostDevice {
 public:
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
  using Staging = Array<T>;

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
  template <class F>
  void cooperate(std::size_t, const F& f) {
    HostTeam team;
    f(team);
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
  void group(std::span<const std::uint32_t> values, const std::uint32_t* group_of, std::span<const std::uint32_t> first, std::uint32_t* to) {
    cursor_.assign(first.begin(), first.end());
    for (std::size_t i = 0; i < values.size(); ++i) to[cursor_[group_of[i]]++] = values[i];
  }

  void use() {}
  void simplify(const MeshView& mesh, const WindowCut& cut, const TileFinder& tiles, std::uint32_t) {
    storage_.resize(window_bytes(kWindowVertices, kRowWidth));
    HostTeam team;
    for (std::uint32_t k = 0; k < cut.count; ++k) {
      if (!cut.nodes[k].is_window()) continue;
      const WindowRange window = cut.window(k);
      const BatchTile& tile = tiles.tiles[cut.nodes[k].tile];
      const int capacity = static_cast<int>((window.count + 3) / 4 * 4);
      simplify_window(team, mesh, window, tile.rules, tile.schedule, storage_.data(), capacity);
    }
  }
  std::size_t vertices_at_once() const { return 1; }
  std::string name() const { return "cpu"; }

 private:
  std::vector<unsigned char> storage_;
  std::vector<std::uint32_t> cursor_;
};

}  // namespace

std::unique_ptr<Simplifier> make_host_waves(ParallelFor parallel) {
  return std::make_unique<WaveSimplifier<HostDevice>>(std::make_unique<HostDevice>(), std::move(parallel));
}

}  // namespace cordillera::gpu
