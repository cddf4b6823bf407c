#include "gpu/waves.inl"

namespace cordillera::gpu {
namespace {

/// One thread, plain loops.
struct HostTeam {
  template <class F>
  void each(int n, const F& f) {
    for (int i = 0; i < n; ++i) f(i);
  }
  template <class Classify>
  void sort_out(int n, const Classify& classify, const WaveLists& lists) {
    int touched = 0, candidates = 0, stale = 0;
    for (int u = 0; u < n; ++u) {
      const unsigned in = classify(u);
      if (in & kTouchedList) lists.touched[touched++] = static_cast<std::uint16_t>(u);
      if (in & kCandidateList) lists.candidates[candidates++] = static_cast<std::uint16_t>(u);
      if (in & kStaleList) lists.stale[stale++] = static_cast<std::uint16_t>(u);
    }
    lists.counts[0] = touched;
    lists.counts[1] = candidates;
    lists.counts[2] = stale;
  }
  void barrier() {}
};

class HostBackend {
 public:
  void begin(BatchMesh&) {}
  void run(BatchMesh& mesh, const WindowPass& pass) {
    number_windows(mesh, pass.cut);
    const MeshView view = mesh.view();
    HostTeam team;
    for (std::size_t k = 0; k < pass.cut.windows.size(); ++k) {
      const WindowRange& range = pass.cut.windows[k];
      const int capacity = static_cast<int>((range.count + 3) / 4 * 4);
      storage_.resize(window_bytes(kWindowVertices));
      simplify_window(team, view, pass.cut.order.data(), range, static_cast<std::uint32_t>(k), pass.rules[range.tile],
                      pass.schedules[range.tile], storage_.data(), capacity);
    }
  }
  void finish(BatchMesh&) {}
  std::size_t vertices_at_once() const { return 1; }
  std::string name() const { return "cpu"; }

 private:
  std::vector<unsigned char> storage_;
};

}  // namespace

std::unique_ptr<Simplifier> make_host_waves() { return std::make_unique<WaveSimplifier<HostBackend>>(HostBackend{}); }

}  // namespace cordillera::gpu
