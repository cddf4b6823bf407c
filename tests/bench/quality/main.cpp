// quality_bench [device] [options]: error, time and hash of every quality on one terrain, a table on stdout.
//   --json            JSON instead
//   --hash            only the hashes: what two devices must agree on
//   --side N          samples along a side of the made terrain; 999
//   --terrain T       alpine, rolling, city, islands, noise, plane
//   --raw F C R CELL  instead: float32 heights from file F, C columns and R rows from the south-west, CELL metres apart
//   --quality Q       only fast, fit (fast and three sweeps), default, best or minimax
//   --threads N       of a CPU; 0: as many as the machine has. 1
//   --grid            as a grid whose heights lie on the device beforehand, not as a mesh
//   --repeat N        the fastest of so many calls counts. 1
//   --keep S          only this share of the triangles; else 0.5984, 0.1 and 0.01
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "gpu/fit/simplify_height_grid.h"
#include "tests/bench/pyramid/terrain.h"

using namespace cordillera;
using namespace cordillera::gpu::fit;

namespace {

struct Options {
  std::string device = "auto", terrain = "alpine", raw, quality;
  bool json = false, hash = false, grid = false;
  int repeats = 1;
  std::uint32_t side = 999, columns = 0, rows = 0;
  unsigned threads = 1;
  double cell_m = 30;
  std::vector<double> keep{0.5984, 0.1, 0.01};
};

Options options_of(int argc, char** argv) {
  Options options;
  for (int k = 1; k < argc; ++k) {
    const std::string argument = argv[k];
    const auto value = [&] { return k + 1 < argc ? argv[++k] : ""; };
    const auto number = [&] { return static_cast<std::uint32_t>(std::atoi(value())); };
    if (argument == "--json")
      options.json = true;
    else if (argument == "--hash")
      options.hash = true;
    else if (argument == "--side")
      options.side = number();
    else if (argument == "--terrain")
      options.terrain = value();
    else if (argument == "--quality")
      options.quality = value();
    else if (argument == "--grid")
      options.grid = true;
    else if (argument == "--repeat")
      options.repeats = std::atoi(value());
    else if (argument == "--threads")
      options.threads = number();
    else if (argument == "--keep")
      options.keep = {std::atof(value())};
    else if (argument == "--raw") {
      options.raw = value();
      options.columns = number();
      options.rows = number();
      options.cell_m = std::atof(value());
    } else
      options.device = argument;
  }
  if (options.raw.empty()) options.columns = options.rows = options.side;
  return options;
}

std::vector<float> heights_of(const Options& options) {
  std::vector<float> heights(std::size_t{options.columns} * options.rows);
  if (!options.raw.empty()) {
    std::ifstream(options.raw, std::ios::binary)
        .read(reinterpret_cast<char*>(heights.data()), static_cast<std::streamsize>(heights.size() * sizeof(float)));
    return heights;
  }
  int kind = 0;
  while (kind < 5 && bench::kTerrainNames[kind] != options.terrain) ++kind;
  for (std::uint32_t i = 0; i < heights.size(); ++i) {
    const std::int32_t height =
        bench::terrain_height(static_cast<bench::Terrain>(kind), i % options.columns, i / options.columns);
    heights[i] = height == INT32_MIN ? 0 : static_cast<float>(height) / 1024;
  }
  return heights;
}

HeightMesh mesh_of(const Options& options, const std::vector<float>& heights) {
  HeightMesh mesh;
  const std::uint32_t columns = options.columns;
  for (std::uint32_t i = 0; i < heights.size(); ++i) {
    mesh.x.push_back(i % columns * options.cell_m);
    mesh.y.push_back(i / columns * options.cell_m);
    mesh.z.push_back(static_cast<double>(heights[i]));
  }
  for (std::uint32_t row = 0; row + 1 < options.rows; ++row) {
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      const std::uint32_t a = row * columns + column, b = a + 1, c = a + columns, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
  return mesh;
}

/// FNV-1a over the bytes of vertices and triangles.
struct Hash {
  std::uint64_t value = 0xcbf29ce484222325u;
  void add(const void* data, std::size_t bytes) {
    for (std::size_t k = 0; k < bytes; ++k) value = (value ^ static_cast<const unsigned char*>(data)[k]) * 0x100000001b3u;
  }
};
std::uint64_t hash_of(const HeightMesh& mesh) {
  Hash hash;
  for (const auto* values : {&mesh.x, &mesh.y, &mesh.z}) hash.add(values->data(), values->size() * sizeof(double));
  hash.add(mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
  return hash.value;
}

struct Way {
  const char* name;
  MeshOptions options;
};

/// cpu_s: of the whole call, checks and the report's measuring included; it says more than a clock on a wall where others compute
/// too.
void print_row(const Options& options, const Way& way, const SimplifiedMesh& result, double cpu_s) {
  const MeshReport& report = result.report;
  const std::uint64_t hash = hash_of(result.mesh);
  if (options.hash) {
    std::printf("%s %" PRIu64 " %016" PRIx64 "\n", way.name, report.triangles, hash);
  } else if (options.json) {
    static bool first = true;
    std::printf("%s\n{\"quality\":\"%s\",\"triangles\":%" PRIu64 ",\"vertices\":%" PRIu64
                ",\"rmse_m\":%.6f,\"max_error_m\":%.6f,\"simplify_seconds\":%.6f,\"cpu_seconds\":%.6f,\"device\":\"%s\",\"hash\":"
                "\"%016" PRIx64 "\"}",
                first ? "" : ",", way.name, report.triangles, report.vertices, report.rmse_m, report.max_error_m, report.seconds,
                cpu_s, report.device.c_str(), hash);
    first = false;
  } else {
    std::printf("%-8s %8" PRIu64 " %9.4f %9.3f %8.4f %8.3f  %016" PRIx64 " ", way.name, report.triangles, report.rmse_m,
                report.max_error_m, report.seconds, cpu_s, hash);
    for (const MeshStage& stage : report.stages) std::printf(" %s %.2f", stage.name.c_str(), 1e3 * stage.seconds);
    std::printf("\n");
  }
  std::fflush(stdout);
}

/// The terrain as a mesh, or as a grid that stays on a device.
class Input {
 public:
  explicit Input(const Options& options) : heights_(heights_of(options)) {
    if (!options.grid) {
      mesh_ = mesh_of(options, heights_);
      return;
    }
    auto simplifier = GridSimplifier::make(options.device, options.threads);
    if (!simplifier.ok()) fail(simplifier.problem());
    simplifier_ = std::move(*simplifier);
    const HeightGrid grid{heights_.data(), false, options.columns, options.rows, 0, 0, options.cell_m, options.cell_m};
    grid_ = simplifier_->keep(grid);
  }

  SimplifiedMesh simplified(const MeshTarget& target, const MeshOptions& options) {
    auto result = simplifier_ ? simplifier_->simplify(grid_, target, options) : simplify(mesh_, target, options);
    if (!result.ok()) fail(result.problem());
    return std::move(*result);
  }

 private:
  [[noreturn]] static void fail(const proto::Problem& problem) {
    std::fprintf(stderr, "%s\n", problem.line().c_str());
    std::exit(1);
  }

  std::vector<float> heights_;
  HeightMesh mesh_;
  std::optional<GridSimplifier> simplifier_;
  HeightGrid grid_;
};

void measure(const Options& options, Input& input, const Way& way, double keep) {
  std::optional<SimplifiedMesh> best;
  double best_s = 0;
  for (int k = 0; k < options.repeats; ++k) {
    const std::clock_t before = std::clock();
    SimplifiedMesh result = input.simplified(MeshTarget::keep(keep), way.options);
    const double cpu_s = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
    if (best && best->report.seconds <= result.report.seconds) continue;
    best = std::move(result);
    best_s = cpu_s;
  }
  print_row(options, way, *best, best_s);
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = options_of(argc, argv);
  Input input(options);
  const Way ways[] = {{"fast", {Quality::fast, options.device, options.threads}},
                      {"fit", {Quality::fast, options.device, options.threads, 3, 0}},
                      {"default", {Quality::default_, options.device, options.threads}},
                      {"best", {Quality::best, options.device, options.threads}},
                      {"minimax", {Quality::minimax, options.device, options.threads}}};
  if (options.json)
    std::printf("[");
  else if (!options.hash)
    std::printf("# %u x %u vertices%s\n# quality triangles rmse-m max-m seconds cpu-seconds hash stages-ms\n", options.columns,
                options.rows, options.grid ? ", a grid that lies on the device" : "");
  for (const Way& way : ways) {
    if (!options.quality.empty() && options.quality != way.name) continue;
    for (const double keep : options.keep) measure(options, input, way, keep);
  }
  if (options.json) std::printf("]\n");
  return 0;
}
