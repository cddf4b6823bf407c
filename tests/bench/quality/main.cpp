// quality_bench [device] [options]: error, time and hash of every quality on one terrain, a table on stdout.
//   --json            JSON instead
//   --hash            only the hashes: what two devices must agree on
//   --side N          samples along a side of the made terrain; 999
//   --terrain T       alpine, rolling, city, islands, noise, plane, ridge, cliff, faint, high, extreme
//   --first N         sample of that terrain in the south-western corner; 0
//   --raw F C R CELL  instead: float32 heights from file F, C columns and R rows from the south-west, CELL metres apart
//   --quality Q       only fast, fit (fast and three sweeps), default, best or minimax
//   --threads N       of a CPU; 0: one for each usable core. 1
//   --grid            as a grid whose heights lie on the device beforehand, not as a mesh
//   --repeat N        the fastest of so many calls counts. 1
//   --between         simplifies every second sample of every second row and measures at all of them, too: what lies between the
//   samples
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
#include "gpu/fit/vertical_error.h"
#include "tests/bench/mesh_hash.h"
#include "tests/bench/quality/dems.h"

using namespace cordillera;
using namespace cordillera::gpu::fit;

namespace {

struct Options {
  std::string device = "auto", terrain = "alpine", raw, quality;
  bool json = false, hash = false, grid = false, between = false;
  int repeats = 1;
  std::uint32_t side = 999, first = 0, columns = 0, rows = 0;
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
    else if (argument == "--first")
      options.first = number();
    else if (argument == "--terrain")
      options.terrain = value();
    else if (argument == "--quality")
      options.quality = value();
    else if (argument == "--grid")
      options.grid = true;
    else if (argument == "--between")
      options.between = true;
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
  heights = bench::dem_heights(options.terrain, options.side, options.first);
  if (heights.empty()) {
    std::fprintf(stderr, "there is no terrain \"%s\"\n", options.terrain.c_str());
    std::exit(1);
  }
  return heights;
}

/// cpu_s: of the whole call, checks and the report's measuring included; it says more than a clock on a wall where others compute
/// too.
void print_row(const Options& options, const bench::Way& way, const SimplifiedMesh& result, double cpu_s,
               const gpu::VerticalError& between) {
  const MeshReport& report = result.report;
  const std::uint64_t hash = bench::hash_of(result.mesh);
  if (options.hash) {
    std::printf("%s %" PRIu64 " %016" PRIx64 "\n", way.name, report.triangles, hash);
  } else if (options.json) {
    static bool first = true;
    std::printf("%s\n{\"quality\":\"%s\",\"triangles\":%" PRIu64 ",\"vertices\":%" PRIu64
                ",\"rmse_m\":%.6f,\"max_error_m\":%.6f,\"simplify_seconds\":%.6f,\"cpu_seconds\":%.6f,\"device\":\"%s\",\"hash\":"
                "\"%016" PRIx64 "\"",
                first ? "" : ",", way.name, report.triangles, report.vertices, report.rmse_m, report.max_error_m, report.seconds,
                cpu_s, report.device.c_str(), hash);
    if (options.between) std::printf(",\"rmse_between_m\":%.6f,\"max_between_m\":%.6f", between.rmse, between.max);
    std::printf("}");
    first = false;
  } else {
    std::printf("%-8s %8" PRIu64 " %9.4f %9.3f %8.4f %8.3f  %016" PRIx64 " ", way.name, report.triangles, report.rmse_m,
                report.max_error_m, report.seconds, cpu_s, hash);
    if (options.between) std::printf(" between %.4f %.3f", between.rmse, between.max);
    for (const proto::StageTime& stage : report.stages) std::printf(" %s %.2f", stage.name.c_str(), 1e3 * stage.seconds);
    std::printf("\n");
  }
  std::fflush(stdout);
}

/// The terrain as a mesh, or as a grid that stays on a device.
class Input {
 public:
  explicit Input(Options options) : heights_(heights_of(options)) {
    if (options.between) {
      all_ = bench::mesh_of(heights_, options.columns, options.cell_m);
      heights_ = bench::every_second(heights_, options.columns);
      options.columns = (options.columns + 1) / 2, options.rows = (options.rows + 1) / 2;
      options.cell_m *= 2;
    }
    if (!options.grid) {
      mesh_ = bench::mesh_of(heights_, options.columns, options.cell_m);
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

  /// Of a result, at all samples; with options.between only.
  gpu::VerticalError between(const SimplifiedMesh& result) const {
    if (all_.x.empty()) return {};
    return gpu::vertical_error({result.mesh.x, result.mesh.y, result.mesh.z, result.mesh.triangles}, {all_.x, all_.y, all_.z});
  }

 private:
  [[noreturn]] static void fail(const proto::Problem& problem) {
    std::fprintf(stderr, "%s\n", problem.line().c_str());
    std::exit(1);
  }

  std::vector<float> heights_;
  HeightMesh mesh_, all_;
  std::optional<GridSimplifier> simplifier_;
  HeightGrid grid_;
};

void measure(const Options& options, Input& input, const bench::Way& way, double keep) {
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
  print_row(options, way, *best, best_s, input.between(*best));
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = options_of(argc, argv);
  Input input(options);
  if (options.json)
    std::printf("[");
  else if (!options.hash)
    std::printf("# %u x %u vertices%s\n# quality triangles rmse-m max-m seconds cpu-seconds hash stages-ms\n", options.columns,
                options.rows, options.grid ? ", a grid that lies on the device" : "");
  for (const bench::Way& way : bench::ways(options.device, options.threads)) {
    if (!options.quality.empty() && options.quality != way.name) continue;
    for (const double keep : options.keep) measure(options, input, way, keep);
  }
  if (options.json) std::printf("]\n");
  return 0;
}
