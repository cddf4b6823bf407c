// exact_bench DEVICE THREADS FILE SIDE SCALE TOLERANCE [--levels 5] [--blocks 1] [--split 1] [--quality fast|standard|best]
// [--repeat 1] [--above 0] [--judge]
//   FILE: SIDE x SIDE 16-bit integers, southern row first, times SCALE metres, -32768 where void; or made:NAME, a terrain of
//   tests/bench/terrain.h TOLERANCE: metres of the finest level, doubled a level
//   --split N: the raster as N x N blocks that share their inner sides
//   --above N: the coarsest N levels are made above the block, without samples (one block)
//   --blocks N: N x N copies of the raster in one call, each turned so that no two are alike
#include <atomic>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>

#include "tests/bench/terrain.h"
#include "tests/gpu/exact_above.h"
#include "tests/gpu/exact_judge.h"

using namespace cordillera;
using namespace cordillera::gpu::exact;

namespace {

struct Options {
  std::string device, file;
  int threads = 1, side = 0, levels = 5, blocks = 1, split = 1, repeat = 1, above = 0;
  double scale_m = 1, tolerance_m = 1;
  Quality quality = Quality::standard;
  Measure measure = Measure::shape;
};

Options read_options(int count, char** words) {
  Options o;
  if (count < 7) {
    std::fputs(
        "exact_bench DEVICE THREADS FILE SIDE SCALE TOLERANCE [--levels 5] [--blocks 1] [--split 1] [--quality "
        "fast|standard|best] [--repeat "
        "1] [--above 0] [--judge]\n",
        stderr);
    std::exit(2);
  }
  o.device = words[1];
  o.threads = std::atoi(words[2]);
  o.file = words[3];
  o.side = std::atoi(words[4]);
  o.scale_m = std::atof(words[5]);
  o.tolerance_m = std::atof(words[6]);
  for (int k = 7; k < count; ++k) {
    const std::string word = words[k], value = k + 1 < count ? words[k + 1] : "";
    if (word == "--judge") o.measure = Measure::samples;
    if (word == "--levels") o.levels = std::atoi(value.c_str());
    if (word == "--blocks") o.blocks = std::atoi(value.c_str());
    if (word == "--split") o.split = std::atoi(value.c_str());
    if (word == "--above") o.above = std::atoi(value.c_str());
    if (word == "--repeat") o.repeat = std::atoi(value.c_str());
    if (word == "--quality") o.quality = value == "fast" ? Quality::fast : value == "best" ? Quality::best : Quality::standard;
  }
  return o;
}

/// Threads that take the next piece of work; started for every call, which a bench can bear.
gpu::ParallelFor over_threads(int threads) {
  return [threads](std::size_t count, const std::function<void(std::size_t)>& work) {
    if (threads <= 1 || count <= 1) return gpu::one_after_the_other(count, work);
    std::atomic<std::size_t> next{0};
    const auto take = [&] {
      for (std::size_t i; (i = next.fetch_add(1)) < count;) work(i);
    };
    std::vector<std::thread> others;
    for (int t = 1; t < threads; ++t) others.emplace_back(take);
    take();
    for (std::thread& other : others) other.join();
  };
}

proto::Samples read_raster(const Options& o) {
  proto::Samples samples;
  samples.columns = samples.rows = o.side;
  for (int kind = 0; kind < 6; ++kind) {
    if (o.file != "made:" + std::string(bench::kTerrainNames[kind])) continue;
    for (int y = 0; y < o.side; ++y) {
      for (int x = 0; x < o.side; ++x) samples.height.push_back(bench::terrain_height(static_cast<bench::Terrain>(kind), x, y));
    }
    return samples;
  }
  std::vector<std::int16_t> raw(static_cast<std::size_t>(o.side) * static_cast<std::size_t>(o.side));
  std::ifstream file(o.file, std::ios::binary);
  file.read(reinterpret_cast<char*>(raw.data()), static_cast<std::streamsize>(raw.size() * 2));
  if (!file) {
    std::fprintf(stderr, "%s: not %d x %d 16-bit integers\n", o.file.c_str(), o.side, o.side);
    std::exit(1);
  }
  for (const std::int16_t n : raw)
    samples.height.push_back(n == INT16_MIN ? proto::kNoHeight : static_cast<std::int32_t>(std::lround(n * o.scale_m * 1024)));
  return samples;
}

proto::Samples turned(const proto::Samples& from, int turn) {
  proto::Samples to = from;
  const int last = from.columns - 1;
  for (int y = 0; y <= last; ++y) {
    for (int x = 0; x <= last; ++x)
      to.height[static_cast<std::size_t>(y) * static_cast<std::size_t>(from.columns) + static_cast<std::size_t>(x)] =
          from.at(turn & 1 ? last - x : x, turn & 2 ? last - y : y);
  }
  return to;
}

void print_level(const BlockPlan& plan, std::size_t l, const std::vector<std::vector<BlockMesh>>& meshes,
                 std::span<const Block> blocks, const Options& o, const LevelTime& time) {
  std::size_t triangles = 0, wrong = 0;
  double max_m = 0, squares = 0, judged_max_m = 0, judged_rmse_m = 0;
  std::uint64_t measured = 0, hash = 0;
  int valence = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const BlockMesh& mesh = meshes[b][l];
    const Verdict verdict = Judge(blocks[b], plan, l).judge(mesh, o.measure);
    triangles += mesh.triangles.size();
    max_m = std::max(max_m, mesh.max_error_m);
    squares += mesh.rmse_m * mesh.rmse_m * static_cast<double>(mesh.measured);
    measured += mesh.measured;
    hash = hash * 31 + verdict.hash;
    valence = std::max(valence, verdict.valence);
    wrong += verdict.turned + verdict.astride + verdict.uncovered + verdict.hidden + verdict.invented + verdict.mislabelled +
             (verdict.exact_area ? 0 : 1);
    judged_max_m = std::max(judged_max_m, verdict.max_m);
    judged_rmse_m = verdict.rmse_m;
  }
  std::printf(
      "level -%zu %8.2f m: %9zu triangles, simplify %8.2f ms, measure %6.2f, download %6.2f, max %.4f m (%.4f), rmse %.4f m, "
      "valence %d, wrong %zu, hash %016" PRIx64,
      l, plan.levels[l].tolerance_m, triangles, 1e3 * time.simplify_s, 1e3 * time.measure_s, 1e3 * time.download_s, max_m,
      max_m / plan.levels[l].tolerance_m, measured ? std::sqrt(squares / static_cast<double>(measured)) : 0, valence, wrong,
      hash);
  if (o.measure == Measure::samples)
    std::printf(", judged %.4f %.4f%s", judged_max_m, judged_rmse_m, judged_max_m > plan.levels[l].tolerance_m ? " ABOVE" : "");
  std::printf("\n");
}

}  // namespace

int main(int count, char** words) {
  const Options o = read_options(count, words);
  const proto::Samples raster = read_raster(o);
  std::vector<proto::Samples> rasters;
  for (int k = 0; k < o.blocks * o.blocks; ++k) rasters.push_back(turned(raster, k));
  std::vector<Block> blocks;
  for (const proto::Samples& samples : rasters) {
    for (int k = 0; k < o.split * o.split; ++k) {
      const int x = k % o.split, y = k / o.split, cells = (o.side - 1) / o.split;
      const auto kind = [&](bool inner) { return inner ? SideKind::shared : SideKind::outer; };
      blocks.push_back({&samples,
                        x * cells,
                        y * cells,
                        cells + 1,
                        cells + 1,
                        {kind(y > 0), kind(x + 1 < o.split), kind(y + 1 < o.split), kind(x > 0)}});
    }
  }
  BlockPlan plan;
  plan.quality = o.quality;
  plan.levels = doubling_levels(o.tolerance_m, o.levels);
  auto made = make_block_simplifier(o.device, over_threads(o.threads));
  if (!made.ok()) {
    std::fprintf(stderr, "%s\n", made.problem().line().c_str());
    return 1;
  }
  BlockSimplifier& simplifier = **made;
  std::printf("%s, %d threads, %s, %zu blocks of %d x %d\n", simplifier.device().c_str(), o.threads, o.file.c_str(),
              blocks.size(), blocks[0].columns, blocks[0].rows);
  for (int r = 0; r < o.repeat; ++r) {
    if (o.above > 0) {
      const auto result = simplified_above(simplifier, blocks[0], plan, plan.levels.size() - static_cast<std::size_t>(o.above));
      if (!result.ok()) {
        std::fprintf(stderr, "%s\n", result.problem().line().c_str());
        return 1;
      }
      if (r + 1 < o.repeat) continue;
      const std::vector<LevelTime>& times = simplifier.times().levels;  // of the levels above
      for (std::size_t l = 0; l < plan.levels.size(); ++l)
        print_level(plan, l, {*result}, {blocks.data(), 1}, o,
                    l + times.size() < plan.levels.size() ? LevelTime() : times[l + times.size() - plan.levels.size()]);
      continue;
    }
    const auto result = simplifier.simplify(blocks, plan);
    if (!result.ok()) {
      std::fprintf(stderr, "%s\n", result.problem().line().c_str());
      return 1;
    }
    const BlockTimes& times = simplifier.times();
    double simplify_s = times.bounds_s + times.start_s, measure_s = 0;
    for (const LevelTime& time : times.levels) simplify_s += time.simplify_s, measure_s += time.measure_s;
    std::printf(
        "load %.2f, bounds %.2f, start %.2f ms (%" PRIu64 " vertices); bounds, start and levels %.2f ms, measuring %.2f ms\n",
        1e3 * times.load_s, 1e3 * times.bounds_s, 1e3 * times.start_s, times.start_vertices, 1e3 * simplify_s, 1e3 * measure_s);
    if (r + 1 < o.repeat) continue;
    for (std::size_t l = 0; l < plan.levels.size(); ++l) print_level(plan, l, *result, blocks, o, times.levels[l]);
  }
  return 0;
}
