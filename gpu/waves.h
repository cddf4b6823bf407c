#pragma once
// Strategy `waves`: the production simplifier. Parallel half-edge collapse in windows, as waves of independent sets.
//
// The driver below is written once; a Backend runs a pass of windows on one kind of device:
//   Backend(...)                     chosen device
//   begin(BatchMesh&)                takes the batch's arrays
//   run(BatchMesh&, pass)            runs all windows of a pass; afterwards mesh.mark is up to date on the host
//   finish(BatchMesh&)               all arrays are up to date on the host
//   vertices_at_once()               how large a batch pays
//   name()
#include <memory>
#include <vector>

#include "gpu/simplify.h"
#include "gpu/window_cut.h"

namespace cordillera::gpu {

/// All tiles of a batch, one after the other; see MeshView for the arrays.
struct BatchMesh {
  std::vector<std::int32_t> x, y;
  std::vector<float> elevation, carried, spent;
  std::vector<std::uint32_t> key, row, window;
  std::vector<std::uint16_t> local;
  std::vector<std::uint8_t> valence, mark;
  std::vector<std::size_t> first;  ///< indexed by tile: its first vertex; one more at the end

  std::size_t vertices() const { return x.size(); }
  void append(const SimplifyJob& job);
  MeshView view();
};

/// What a backend needs to run one pass.
struct WindowPass {
  WindowCut cut;
  std::vector<Rules> rules;             ///< indexed by tile
  std::vector<WaveSchedule> schedules;  ///< indexed by tile
};

/// Numbers every vertex by its window and place there.
void number_windows(BatchMesh& mesh, const WindowCut& cut);

/// The survivors of tile t as a mesh; removes what must go and is still there.
proto::TileMesh extract(const BatchMesh& mesh, std::size_t tile, const SimplifyJob& job);

Rules rules_of(const SimplifyJob& job);
WaveSchedule schedule_of(const SimplifyJob& job);

template <class Backend>
class WaveSimplifier final : public Simplifier {
 public:
  explicit WaveSimplifier(Backend backend) : backend_(std::move(backend)) {}

  std::vector<proto::TileMesh> simplify(std::span<const SimplifyJob> jobs) override;
  std::string device() const override { return backend_.name(); }

 private:
  static constexpr int kPasses = 3;       // seams of one pass lie inside windows of the next
  static constexpr int kMostPasses = 12;
  void simplify_batch(std::span<const SimplifyJob> jobs, std::vector<proto::TileMesh>& results);
  Backend backend_;
};

std::unique_ptr<Simplifier> make_host_waves();
/// Null with a reason when the device cannot be used.
proto::Result<std::unique_ptr<Simplifier>> make_cuda_waves(int device);

}  // namespace cordillera::gpu
