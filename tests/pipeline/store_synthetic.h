#pragma once
// A small published dataset made without a build: every level from synthetic tiles, tiles without triangles left out.
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "pipeline/store/store.h"
#include "tests/pipeline/encode_synthetic.h"

namespace cordillera::pipeline::testing {

/// A folder that goes away with the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "cordillera-XXXXXX").string();
    path_ = mkdtemp(name.data());  // a process number comes again, and may find what a killed one left
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// A file's bytes.
inline std::string bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}
inline void put_bytes(const std::string& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

inline proto::Plan synthetic_plan(int finest, int coarsest = 0) {
  proto::Plan plan;
  plan.set_finest_level(static_cast<std::uint32_t>(finest));
  plan.set_min_level(static_cast<std::uint32_t>(coarsest));
  plan.set_promise(true);
  for (int z = finest; z >= coarsest; --z) {
    proto::LevelPlan& level = *plan.add_levels();
    level.set_level(static_cast<std::uint32_t>(z));
    level.set_target(std::ldexp(1, finest - z));
    level.set_ecef_step(smallest_ecef_step_m(z));
    level.set_chain_tolerance(20);
    level.set_height_step(proto::kHeightStep_m);
  }
  return plan;
}

/// The stated error grows with the level's cell and differs from tile to tile; not every parent's is above its children's.
inline double synthetic_error(const proto::Lattice& lattice, const proto::TileAddress& t) {
  return 0.5 * static_cast<double>(lattice.cell_units(t.z)) + 0.01 * ((t.x * 7 + t.y * 13) % 90);
}

inline std::optional<EncodedTile> synthetic_tile(const proto::Lattice& lattice, const proto::TileAddress& t,
                                                 const Heights& heights) {
  const proto::TileMesh mesh = synthetic_mesh(lattice, t, 8, heights);
  EncodeInput input = encode_input(lattice, t, mesh);
  input.geometric_error_m = synthetic_error(lattice, t);
  EncodedTile out{{}, encode_drc(input), encode_glb(input)};
  if (out.drc.empty()) return std::nullopt;
  out.record.set_level(static_cast<std::uint32_t>(t.z));
  out.record.set_x(static_cast<std::uint32_t>(t.x));
  out.record.set_y(static_cast<std::uint32_t>(t.y));
  out.record.set_vertices(81);
  out.record.set_triangles(128);
  out.record.set_max_error(input.geometric_error_m);
  out.record.set_sum_squared_error(100);
  out.record.set_samples(400);
  // A coarse level may go deeper than the data, by its error.
  const double lowest_m = *std::min_element(mesh.height.begin(), mesh.height.end()) * proto::kHeightStep_m;
  out.record.set_min_height(lowest_m < 0 ? lowest_m - 30 * input.geometric_error_m : 100);
  out.record.set_max_height(1600);
  for (const double number : tile_region(input)) out.record.add_region(number);
  return out;
}

/// One task a tile, finest level first, for the tiles of level z between (x0, y0) and (x1, y1) and all above them.
inline std::vector<FinishedTask> synthetic_tasks(const proto::Lattice& lattice, const proto::TileAddress& first,
                                                 const proto::TileAddress& last, const Heights& heights) {
  std::vector<FinishedTask> tasks;
  for (int z = first.z; z >= 0; --z) {
    const int up = first.z - z;
    for (std::int32_t y = first.y >> up; y <= last.y >> up; ++y) {
      for (std::int32_t x = first.x >> up; x <= last.x >> up; ++x) {
        FinishedTask task;
        task.node = {z, x, y};
        task.mesh = {task.node, "mesh of " + std::to_string(z) + std::string(3000, '.')};
        if (auto tile = synthetic_tile(lattice, task.node, heights)) task.tiles.push_back(std::move(*tile));
        for (int c = 0; z < first.z && c < 4; ++c) task.consumed.push_back(task.node.child(c));
        tasks.push_back(std::move(task));
      }
    }
  }
  return tasks;
}

inline proto::Manifest synthetic_manifest() {
  proto::Manifest manifest;
  manifest.set_id("synthetic");
  manifest.set_name("hills");
  manifest.set_title("Synthetic hills");
  manifest.set_attribution("Nobody <nobody@example.org>");
  return manifest;
}

}  // namespace cordillera::pipeline::testing
