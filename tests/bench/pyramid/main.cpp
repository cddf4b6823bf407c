// pyramid_bench [device] [tiles across] [tolerance_m] [options]: hashes and times of six terrains, a table on stdout.
//   --json         JSON instead
//   --stages       what the time of a level went into
//   --terrain T    only this one
//   --repeat N     simplifies every level N times; the fastest counts
//   --threads N    threads for what remains on the host
//   --alone        every tile in a call of its own, instead of a level in one
//   --sparse S     the finest level starts without what is nearer than S times the tolerance to what remains; builds do with 0.25
//   --levels N     only so many, from the finest
//   --errors       measures every level against all finest samples, too, with the device's help
//   --strategy S   waves, or cleap or sequential
#include <atomic>
#include <cinttypes>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <thread>

#include "gpu/cleap/tile_simplifier.h"
#include "gpu/measure/batch_meter.h"
#include "tests/bench/pyramid/pyramid.h"

using namespace cordillera;

namespace {

struct Options {
  std::string device = "auto";
  int across = 4;
  float tolerance_m = 4;
  bool json = false, stages = false, errors = false;
  bench::PyramidRun run;
  std::string terrain, strategy = gpu::kStrategies.front();
  unsigned threads = 1;
};

Options options_of(int argc, char** argv) {
  Options options;
  int position = 0;
  for (int k = 1; k < argc; ++k) {
    const std::string argument = argv[k];
    const auto value = [&] { return k + 1 < argc ? argv[++k] : ""; };
    if (argument == "--json")
      options.json = true;
    else if (argument == "--stages")
      options.stages = true;
    else if (argument == "--terrain")
      options.terrain = value();
    else if (argument == "--repeat")
      options.run.repeats = std::atoi(value());
    else if (argument == "--errors")
      options.errors = true;
    else if (argument == "--alone")
      options.run.alone = true;
    else if (argument == "--levels")
      options.run.levels = std::atoi(value());
    else if (argument == "--sparse")
      options.run.start_share = static_cast<float>(std::atof(value()));
    else if (argument == "--strategy")
      options.strategy = value();
    else if (argument == "--threads")
      options.threads = static_cast<unsigned>(std::atoi(value()));
    else if (position == 0 && ++position)
      options.device = argument;
    else if (position == 1 && ++position)
      options.across = std::atoi(argument.c_str());
    else
      options.tolerance_m = static_cast<float>(std::atof(argument.c_str()));
  }
  return options;
}

/// Threads that wait for work: to start them anew for every level would show in its time.
class Crew {
 public:
  explicit Crew(unsigned threads) {
    for (unsigned k = 1; k < threads; ++k) threads_.emplace_back([this](const std::stop_token& stop) { serve(stop); });
  }
  void each(std::size_t count, const std::function<void(std::size_t)>& work) {
    {
      const std::lock_guard lock(mutex_);
      work_ = &work;
      count_ = count;
      next_ = 0;
      busy_ = threads_.size();
      ++call_;
    }
    wake_.notify_all();
    take();
    std::unique_lock lock(mutex_);
    done_.wait(lock, [&] { return busy_ == 0; });
  }

 private:
  void take() {
    for (std::size_t i = next_++; i < count_; i = next_++) (*work_)(i);
  }
  void serve(const std::stop_token& stop) {
    for (unsigned seen = 0;;) {
      std::unique_lock lock(mutex_);
      if (!wake_.wait(lock, stop, [&] { return call_ != seen; })) return;
      seen = call_;
      lock.unlock();
      take();
      lock.lock();
      if (--busy_ == 0) done_.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::condition_variable done_;
  const std::function<void(std::size_t)>* work_ = nullptr;
  std::atomic<std::size_t> next_ = 0;
  std::size_t count_ = 0, busy_ = 0;
  unsigned call_ = 0;
  std::vector<std::jthread> threads_;  // last: they stop before the rest goes
};

/// As "name 1.234 ms", one after the other.
void print_stages(const std::vector<proto::StageTime>& stages) {
  for (const proto::StageTime& stage : stages) std::printf(" %s %.3f ms", stage.name.c_str(), 1e3 * stage.seconds);
}
/// What the device itself worked on, the passes, but not what goes to it and comes back.
double on_device_s(const bench::LevelFigures& level) {
  double sum_s = 0;
  for (const proto::StageTime& stage : level.stages)
    sum_s += stage.name == "start" || stage.name.starts_with("pass") ? stage.seconds : 0;
  return sum_s;
}

void print_row(const Options& options, std::string_view terrain, const bench::LevelFigures& level) {
  std::printf("%s %d %zu %zu %zu %zu %.3f %.6f %016" PRIx64 "\n", terrain.data(), level.level, level.tiles, level.vertices_in,
              level.vertices, level.triangles, level.prepare_s, level.simplify_s, level.hash);
  if (!options.stages) return;
  std::printf("#  ");
  print_stages(level.stages);
  if (options.errors) {
    std::printf("\n#   errors in %.3f ms", 1e3 * level.measure_s);
    std::printf("; max %.3f m, RMSE %.4f m", level.max_error_m, level.rmse_m);
  }
  std::printf("\n");
}

void print_json(std::string_view terrain, const bench::LevelFigures& level) {
  static bool first = true;
  std::printf(
      "%s\n{\"terrain\":\"%s\",\"level\":%d,\"tiles\":%zu,\"vertices_in\":%zu,\"vertices\":%zu,\"simplify_seconds\":%.6f,"
      "\"hash\":\"%016" PRIx64 "\",\"measure_seconds\":%.6f,\"max_error_m\":%.17g,\"rmse_m\":%.17g,\"stages_ms\":{",
      first ? "" : ",", terrain.data(), level.level, level.tiles, level.vertices_in, level.vertices, level.simplify_s, level.hash,
      level.measure_s, level.max_error_m, level.rmse_m);
  for (const proto::StageTime& stage : level.stages) {
    std::printf("%s\"%s\":%.3f", &stage == level.stages.data() ? "" : ",", stage.name.c_str(), 1e3 * stage.seconds);
  }
  std::printf("}}");
  first = false;
}

}  // namespace

int main(int argc, char** argv) {
  Options options = options_of(argc, argv);
  Crew crew(options.threads);
  const auto on_crew = [&](std::size_t count, const auto& work) { crew.each(count, work); };
  gpu::cleap::offer_strategies();
  auto simplifier = gpu::make_simplifier(options.device, on_crew, options.strategy);
  if (!simplifier.ok()) {
    std::fprintf(stderr, "%s\n", simplifier.problem().line().c_str());
    return 1;
  }
  std::unique_ptr<gpu::BatchMeter> meter;
  if (options.errors) {
    options.run.errors = true;
    options.run.parallel = on_crew;
    if (auto made = gpu::make_batch_meter(options.device); made.ok()) meter = std::move(*made);
    options.run.meter = meter.get();
  }
  if (options.json) {
    std::printf("[");
  } else {
    std::printf(
        "# %s, %d x %d tiles, tolerance %g m\n# terrain level tiles vertices-in vertices triangles prepare-s simplify-s hash\n",
        (*simplifier)->device().c_str(), options.across, options.across, static_cast<double>(options.tolerance_m));
  }
  for (int kind = 0; kind < 6; ++kind) {
    const std::string_view name = bench::kTerrainNames[kind];
    if (!options.terrain.empty() && options.terrain != name) continue;
    const auto levels =
        bench::run_pyramid(static_cast<bench::Terrain>(kind), options.across, options.tolerance_m, **simplifier, options.run);
    double device_s = 0;
    for (const bench::LevelFigures& level : levels) {
      if (options.json)
        print_json(name, level);
      else
        print_row(options, name, level);
      device_s += on_device_s(level);
    }
    if (options.stages && !options.json && device_s > 0) {
      std::printf("# on the device: %.3f ms, %.3f Gvertex/s\n", 1e3 * device_s,
                  1e-9 * static_cast<double>(levels.front().vertices_in) / device_s);
    }
  }
  if (options.json) std::printf("]\n");
  return 0;
}
