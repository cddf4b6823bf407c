#include <memory>

#include "gpu/device/host_steps.h"
#include "gpu/waves/collapse/host_team.h"
#include "gpu/waves/collapse/waves.inl"

namespace cordillera::gpu {
namespace {

class HostDevice : public HostSteps {
 public:
  template <class T>
  using Staging = Array<T>;

  template <class F>
  void cooperate(std::size_t, const F& f) {
    HostTeam team;
    f(team);
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
      simplify_window(team, mesh, window, tile.rules, storage_.data(), capacity);
    }
  }
  std::size_t vertices_at_once() const { return 1; }
  std::string name() const { return "cpu"; }

 private:
  std::vector<unsigned char> storage_;
};

}  // namespace

std::unique_ptr<Simplifier> make_host_waves(ParallelFor parallel) {
  return std::make_unique<WaveSimplifier<HostDevice>>(std::make_unique<HostDevice>(), std::move(parallel));
}

}  // namespace cordillera::gpu
