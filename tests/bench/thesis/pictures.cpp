// thesis_pictures MESH OUT.ppm SIZE KIND...: pictures of a mesh from above, SIZE pixels high and wide.
//   relief X0 Y0 X1 Y1 [wire]    shaded, the part between these shares of its extent; with its edges
//   density                      dark where vertices are dense
//   candidates METRIC SHARE      yellow: that share of the edges, the cheapest
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "gpu/cleap/cleap.h"
#include "gpu/cleap/metrics.h"
#include "gpu/cleap/working_mesh.h"
#include "gpu/fit/steps/host_steps.h"
#include "proto/mesh_file/mesh_file.h"

using namespace cordillera;
using gpu::fit::HeightMesh;

namespace {

struct Colour {
  double r = 1, g = 1, b = 1;
};

class Picture {
 public:
  explicit Picture(int size) : size_(size), pixels_(static_cast<std::size_t>(size) * static_cast<std::size_t>(size)) {}
  int size() const { return size_; }
  bool holds(int x, int y) const { return x >= 0 && y >= 0 && x < size_ && y < size_; }
  /// From the south-west.
  Colour& at(int x, int y) { return pixels_[static_cast<std::size_t>((size_ - 1 - y) * size_ + x)]; }
  void save(const std::string& path) const {
    std::ofstream out(path, std::ios::binary);
    out << "P6\n" << size_ << " " << size_ << "\n255\n";
    for (const Colour& c : pixels_) {
      for (const double v : {c.r, c.g, c.b}) out.put(static_cast<char>(std::lround(255 * std::clamp(v, 0.0, 1.0))));
    }
  }

 private:
  int size_;
  std::vector<Colour> pixels_;
};

/// Plan coordinates to pixels.
struct Frame {
  double x0, y0, scale;
  double px(double x) const { return (x - x0) * scale; }
  double py(double y) const { return (y - y0) * scale; }
};

struct Share {
  double x0 = 0, y0 = 0, x1 = 1, y1 = 1;
};
Frame frame_of(const HeightMesh& mesh, const Share& share, int size) {
  const auto [west, east] = std::minmax_element(mesh.x.begin(), mesh.x.end());
  const auto [south, north] = std::minmax_element(mesh.y.begin(), mesh.y.end());
  const double extent = std::max(*east - *west, *north - *south);
  const double shown = extent * std::max(share.x1 - share.x0, share.y1 - share.y0);
  return {*west + share.x0 * extent, *south + share.y0 * extent, size / shown};
}

void draw_line(Picture& picture, double x0, double y0, double x1, double y1, const Colour& colour, double strength) {
  const double longest = std::max({std::abs(x1 - x0), std::abs(y1 - y0), 1.0});
  if (longest > 4.0 * picture.size()) return;
  const int steps = static_cast<int>(longest) + 1;
  for (int k = 0; k <= steps; ++k) {
    const int x = static_cast<int>(x0 + (x1 - x0) * k / steps), y = static_cast<int>(y0 + (y1 - y0) * k / steps);
    if (!picture.holds(x, y)) continue;
    Colour& at = picture.at(x, y);
    at = {at.r + (colour.r - at.r) * strength, at.g + (colour.g - at.g) * strength, at.b + (colour.b - at.b) * strength};
  }
}

/// Light from the north-west; green low, brown, white high.
Colour shade(const HeightMesh& mesh, const std::array<std::uint32_t, 3>& t, double low, double high) {
  const double ux = mesh.x[t[1]] - mesh.x[t[0]], uy = mesh.y[t[1]] - mesh.y[t[0]], uz = mesh.z[t[1]] - mesh.z[t[0]];
  const double vx = mesh.x[t[2]] - mesh.x[t[0]], vy = mesh.y[t[2]] - mesh.y[t[0]], vz = mesh.z[t[2]] - mesh.z[t[0]];
  const double a = uy * vz - uz * vy, b = uz * vx - ux * vz, c = ux * vy - uy * vx, length = std::sqrt(a * a + b * b + c * c);
  const double light = 0.25 + 0.75 * std::max(0.0, (-0.55 * a + 0.55 * b + 0.63 * c) / length);
  const double height = ((mesh.z[t[0]] + mesh.z[t[1]] + mesh.z[t[2]]) / 3 - low) / std::max(high - low, 1e-9);
  if (height < 0.001) return {0.55 * light, 0.72 * light, 0.9 * light};
  return {light * (0.45 + 0.5 * height), light * (0.62 + 0.3 * height), light * (0.38 + 0.55 * height)};
}

using Triangle = std::array<std::uint32_t, 3>;

void fill(Picture& picture, const Frame& frame, const HeightMesh& mesh, const Triangle& t, const Colour& colour) {
  double x[3], y[3];
  for (std::size_t k = 0; k < 3; ++k) {
    x[k] = frame.px(mesh.x[t[k]]);
    y[k] = frame.py(mesh.y[t[k]]);
  }
  const int west = std::max(0, static_cast<int>(std::min({x[0], x[1], x[2]}) - 0.5));
  const int east = std::min(picture.size() - 1, static_cast<int>(std::max({x[0], x[1], x[2]}) + 0.5));
  const int south = std::max(0, static_cast<int>(std::min({y[0], y[1], y[2]}) - 0.5));
  const int north = std::min(picture.size() - 1, static_cast<int>(std::max({y[0], y[1], y[2]}) + 0.5));
  for (int j = south; j <= north; ++j) {
    for (int i = west; i <= east; ++i) {
      bool in = true;
      for (int k = 0; k < 3; ++k) {
        const int l = (k + 1) % 3;
        in = in && (x[l] - x[k]) * (j + 0.5 - y[k]) - (y[l] - y[k]) * (i + 0.5 - x[k]) >= -1e-9;
      }
      if (in) picture.at(i, j) = colour;
    }
  }
}

void relief(Picture& picture, const HeightMesh& mesh, const Share& share, bool wire) {
  const Frame frame = frame_of(mesh, share, picture.size());
  const auto [low, high] = std::minmax_element(mesh.z.begin(), mesh.z.end());
  for (const auto& t : mesh.triangles) fill(picture, frame, mesh, t, shade(mesh, t, *low, *high));
  if (!wire) return;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = t[k], w = t[(k + 1) % 3];
      if (v > w) continue;
      draw_line(picture, frame.px(mesh.x[v]), frame.py(mesh.y[v]), frame.px(mesh.x[w]), frame.py(mesh.y[w]), {0.05, 0.05, 0.1},
                0.7);
    }
  }
}

void density(Picture& picture, const HeightMesh& mesh, double full) {
  const Frame frame = frame_of(mesh, {}, picture.size());
  std::vector<double> count(static_cast<std::size_t>(picture.size()) * static_cast<std::size_t>(picture.size()));
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    const int x = std::min(picture.size() - 1, static_cast<int>(frame.px(mesh.x[v])));
    const int y = std::min(picture.size() - 1, static_cast<int>(frame.py(mesh.y[v])));
    count[static_cast<std::size_t>(y * picture.size() + x)] += 1;
  }
  for (int y = 0; y < picture.size(); ++y) {
    for (int x = 0; x < picture.size(); ++x) {
      const double dark = 1 - 0.9 * std::min(1.0, count[static_cast<std::size_t>(y * picture.size() + x)] / full);
      picture.at(x, y) = {dark, dark, dark + (1 - dark) * 0.35};
    }
  }
}

void candidates(Picture& picture, const HeightMesh& mesh, const std::string& metric, double share) {
  using namespace gpu::cleap;
  relief(picture, mesh, {}, false);
  gpu::fit::HostSteps steps(1);
  WorkingMesh<gpu::fit::HostSteps> work(steps);
  work.load(mesh);
  work.connect(false);
  work.sum_planes();
  const Arrays& arrays = work.arrays();
  std::vector<double> cost(arrays.edges);
  with_metric(AllMetrics{}, metric, [&]<class Metric>(Metric) {
    for (std::size_t e = 0; e < cost.size(); ++e) cost[e] = Metric::cost(arrays, arrays.edge[e]);
  });
  std::vector<double> sorted = cost;
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(cost.size()));
  std::nth_element(sorted.begin(), at, sorted.end());
  std::printf("%s %g %.9g\n", metric.c_str(), share, *at);
  const Frame frame = frame_of(mesh, {}, picture.size());
  for (std::size_t e = 0; e < cost.size(); ++e) {
    if (cost[e] > *at) continue;
    const Position &p = arrays.vertex[arrays.edge[e].n[0]], &q = arrays.vertex[arrays.edge[e].n[1]];
    draw_line(picture, frame.px(p.x), frame.py(p.y), frame.px(q.x), frame.py(q.y), {1, 0.92, 0.1}, 0.35);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv, argv + argc);
  if (argc < 5) {
    std::fprintf(stderr, "usage: thesis_pictures MESH OUT.ppm SIZE relief|density|candidates ...\n");
    return 2;
  }
  auto file = proto::read_mesh_file(words[1]);
  if (!file) {
    std::fprintf(stderr, "%s\n", file.problem().line().c_str());
    return 1;
  }
  proto::TriangleMesh& read = file->mesh;
  const HeightMesh mesh{std::move(read.x), std::move(read.y), std::move(read.z), std::move(read.triangles)};
  Picture picture(std::atoi(argv[3]));
  const auto number = [&](std::size_t k, double otherwise) { return k < words.size() ? std::atof(words[k].c_str()) : otherwise; };
  if (words[4] == "relief") {
    relief(picture, mesh, {number(5, 0), number(6, 0), number(7, 1), number(8, 1)}, words.back() == "wire");
  } else if (words[4] == "density") {
    density(picture, mesh, number(5, 6));
  } else {
    candidates(picture, mesh, words.size() > 5 ? words[5] : "qem", number(6, 0.2));
  }
  picture.save(words[2]);
  return 0;
}
