#pragma once
// What all drivers do alike: read a mesh, let the other library have it, write what comes back, say how long its own call took.
#include <time.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "proto/mesh_file/mesh_file.h"

namespace cordillera::bench {

/// Around the library's own call: building its data structures and taking the result out are not its fault.
class Stopwatch {
 public:
  void start() {
    wall_ = std::chrono::steady_clock::now();
    cpu_ = cpu_now();
  }
  void stop() {
    seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count();
    cpu_seconds_ = cpu_now() - cpu_;
  }
  double seconds() const { return seconds_; }
  double cpu_seconds() const { return cpu_seconds_; }

 private:
  static double cpu_now() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }
  std::chrono::steady_clock::time_point wall_;
  double cpu_ = 0, seconds_ = 0, cpu_seconds_ = 0;
};

struct Task {
  proto::TriangleMesh mesh;
  std::size_t triangles = 0;  ///< wished for
  std::string variant;        ///< of the library's methods, if it has several
};

/// DRIVER IN OUT TRIANGLES [VARIANT]. simplify(task, watch) gives a mesh; throws where it cannot.
template <class Simplify>
int drive(int count, char** words, const Simplify& simplify) {
  if (count < 4) {
    std::fprintf(stderr, "usage: %s IN OUT TRIANGLES [VARIANT]\n", words[0]);
    return 2;
  }
  auto file = proto::read_mesh_file(words[1]);
  if (!file) {
    std::fprintf(stderr, "%s\n", file.problem().line().c_str());
    return 1;
  }
  Task task{std::move(file->mesh), std::strtoull(words[3], nullptr, 10), count > 4 ? words[4] : ""};
  try {
    Stopwatch watch;
    const proto::TriangleMesh result = simplify(task, watch);
    if (auto written = proto::write_mesh_file(words[2], result, {}); !written) throw std::runtime_error(written.problem().line());
    std::printf("{\"simplify_seconds\": %.6f, \"simplify_cpu_seconds\": %.6f}\n", watch.seconds(), watch.cpu_seconds());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", words[0], error.what());
    return 1;
  }
  return 0;
}

}  // namespace cordillera::bench
