// thesis_bench [options] SPEC...: runs of the published algorithm and of the production simplifier on one mesh; JSON on stdout.
//   --input FILE       a mesh (.ply, .off, .obj)
//   --raw F C R CELL   float32 heights from file F, C columns and R rows from the south-west, CELL metres apart
//   --terrain T        else a made one: alpine, rolling, city, islands, noise, plane
//   --side N           its samples along a side; 300
//   --device D, --threads N
//   --judge            error, angles and defects of every result, too
//   --out FILE         the last result as a mesh file
// SPEC: words of spec.h, "strategy=cleap window=512 collapses=400000"; or strategy=waves with quality= and triangles=.
#include <cinttypes>
#include <ctime>
#include <fstream>
#include <optional>
#include <vector>

#include "gpu/fit/vertical_error.h"
#include "proto/mesh_file/mesh_file.h"
#include "tests/bench/mesh_hash.h"
#include "tests/bench/terrain.h"
#include "tests/bench/thesis/shapes.h"
#include "tests/bench/thesis/spec.h"

using namespace cordillera;
using namespace cordillera::bench;
using gpu::fit::HeightMesh;

namespace {

struct Line {
  std::string input, raw, terrain = "alpine", device = "auto", out;
  std::uint32_t columns = 300, rows = 300;
  double cell_m = 30;
  unsigned threads = 1;
  bool judge = false;
  std::vector<std::string> specs;
};

Line line_of(int argc, char** argv) {
  Line line;
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    const auto value = [&] { return std::string(k + 1 < argc ? argv[++k] : ""); };
    const auto whole = [&] { return static_cast<std::uint32_t>(std::atoi(value().c_str())); };
    if (word == "--input")
      line.input = value();
    else if (word == "--terrain")
      line.terrain = value();
    else if (word == "--device")
      line.device = value();
    else if (word == "--out")
      line.out = value();
    else if (word == "--side")
      line.columns = line.rows = whole();
    else if (word == "--threads")
      line.threads = whole();
    else if (word == "--judge")
      line.judge = true;
    else if (word == "--raw") {
      line.raw = value();
      line.columns = whole();
      line.rows = whole();
      line.cell_m = std::atof(value().c_str());
    } else
      line.specs.push_back(word);
  }
  return line;
}

double height_of(const Line& line, const std::vector<float>& raw, std::uint32_t i) {
  if (!raw.empty()) return static_cast<double>(raw[i]);
  int kind = 0;
  while (kind < 5 && kTerrainNames[kind] != line.terrain) ++kind;
  const std::int32_t height = terrain_height(static_cast<Terrain>(kind), i % line.columns, i / line.columns);
  return height == INT32_MIN ? 0 : static_cast<double>(height) / 1024;
}

HeightMesh mesh_of(const Line& line) {
  if (!line.input.empty()) {
    auto file = proto::read_mesh_file(line.input);
    if (!file) Spec::fail(file.problem().line());
    return {std::move(file->mesh.x), std::move(file->mesh.y), std::move(file->mesh.z), std::move(file->mesh.triangles)};
  }
  std::vector<float> raw;
  if (!line.raw.empty()) {
    raw.resize(std::size_t{line.columns} * line.rows);
    std::ifstream(line.raw, std::ios::binary)
        .read(reinterpret_cast<char*>(raw.data()), static_cast<std::streamsize>(raw.size() * sizeof(float)));
  }
  HeightMesh mesh;
  for (std::uint32_t i = 0; i < line.columns * line.rows; ++i) {
    mesh.x.push_back(i % line.columns * line.cell_m);
    mesh.y.push_back(i / line.columns * line.cell_m);
    mesh.z.push_back(height_of(line, raw, i));
  }
  mesh.triangles = bench::grid_triangles(line.columns, line.rows);
  return mesh;
}

/// A run's result, and what its own report says as the inside of a JSON object.
struct Done {
  HeightMesh mesh;
  std::string told;
  double seconds = 0;
};

std::string field(const char* name, double value) {
  char text[96];
  std::snprintf(text, sizeof text, "\"%s\": %.9g, ", name, value);
  return text;
}

std::string told_by(const gpu::cleap::Report& report) {
  std::string text = "\"device\": \"" + report.device + "\", ";
  for (const auto& [name, value] :
       std::initializer_list<std::pair<const char*, double>>{{"iterations", report.iterations},
                                                             {"collapses", report.collapses},
                                                             {"passes", report.passes},
                                                             {"tried", report.tried()},
                                                             {"build_seconds", report.build_seconds},
                                                             {"select_seconds", report.select_seconds},
                                                             {"collapse_seconds", report.collapse_seconds},
                                                             {"rearrange_seconds", report.rearrange_seconds},
                                                             {"refine_seconds", report.refine_seconds},
                                                             {"copy_seconds", report.copy_seconds},
                                                             {"seconds", report.seconds()}}) {
    text += field(name, value);
  }
  text += "\"fates\": {";
  for (std::size_t k = 0; k < gpu::cleap::kFates; ++k) {
    if (k > 0) text += ", ";
    text.append("\"").append(name_of(static_cast<gpu::cleap::Fate>(k))).append("\": ").append(std::to_string(report.fates[k]));
  }
  text += "}, \"phases\": {";
  for (std::size_t k = 0; k < report.phases.size(); ++k) {
    if (k > 0) text += ", ";
    text.append("\"").append(report.phases[k].name).append("\": ").append(std::to_string(report.phases[k].seconds));
  }
  text += "}, \"windows\": [";
  for (std::size_t k = 0; k < report.window_collapses.size(); ++k) {
    if (k > 0) text += ',';
    text += std::to_string(report.window_collapses[k]);
  }
  return text + "], ";
}

Done run(const HeightMesh& mesh, const Line& line, const Spec& spec) {
  if (spec.text("strategy", "cleap") == "waves") {
    const auto quality = spec.text("quality", "fast") == "fast" ? gpu::fit::Quality::fast : gpu::fit::Quality::default_;
    auto made = gpu::fit::simplify(mesh, gpu::fit::MeshTarget::triangles(static_cast<std::uint64_t>(spec.number("triangles", 1))),
                                   {quality, line.device, line.threads});
    if (!made) Spec::fail(made.problem().line());
    return {std::move(made->mesh), "\"device\": \"" + made->report.device + "\", " + field("seconds", made->report.seconds),
            made->report.seconds};
  }
  gpu::cleap::Options options = options_of(spec);
  options.device = line.device;
  options.threads = line.threads;
  gpu::cleap::CollapseTarget target;
  target.collapses = static_cast<std::uint64_t>(spec.number("collapses", 0));
  target.triangles = static_cast<std::uint64_t>(spec.number("triangles", 0));
  auto made = gpu::cleap::simplify(mesh, target, options);
  if (!made) Spec::fail(made.problem().line());
  Done done{std::move(made->mesh), told_by(made->report), made->report.seconds()};
  if (spec.has("taubin")) {
    const auto steps = static_cast<std::uint32_t>(spec.number("taubin", 1));
    auto smoothed = gpu::cleap::smooth(done.mesh, steps, line.device, line.threads);
    if (!smoothed) Spec::fail(smoothed.problem().line());
    done.mesh = std::move(*smoothed);
  }
  return done;
}

std::string judged(const HeightMesh& input, const HeightMesh& result) {
  const proto::TriangleMesh surface{result.x, result.y, result.z, result.triangles};
  const gpu::VerticalError error = gpu::vertical_error(surface, {input.x, input.y, input.z});
  const Shapes shapes = shapes_of(result);
  std::string text = field("rmse_m", error.rmse) + field("max_error_m", error.max) +
                     field("uncovered", static_cast<double>(error.uncovered)) +
                     field("turned", static_cast<double>(shapes.turned)) + field("most_triangles", shapes.most_triangles) +
                     field("mean_least_angle_deg", shapes.mean_angle_deg);
  text += "\"least_angles\": [";
  for (std::size_t k = 0; k < shapes.angles.size(); ++k) {
    if (k > 0) text += ',';
    text += std::to_string(shapes.angles[k]);
  }
  return text + "], ";
}

void print_row(const HeightMesh& input, const Line& line, const std::string& words) {
  const Spec spec(words);
  std::optional<Done> best;
  for (int k = 0; k < static_cast<int>(spec.number("repeat", 1)); ++k) {
    const std::clock_t before = std::clock();
    Done done = run(input, line, spec);
    done.told += field("cpu_seconds", static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC);
    if (!best || done.seconds < best->seconds) best = std::move(done);
  }
  std::printf("{\"spec\": \"%s\", %s", words.c_str(), best->told.c_str());
  if (line.judge) std::printf("%s", judged(input, best->mesh).c_str());
  std::printf("\"vertices\": %zu, \"triangles\": %zu, \"hash\": \"%016" PRIx64 "\"}", best->mesh.vertices(),
              best->mesh.triangles.size(), hash_of(best->mesh));
  std::fflush(stdout);
  if (line.out.empty()) return;
  const proto::TriangleMesh surface{best->mesh.x, best->mesh.y, best->mesh.z, best->mesh.triangles};
  if (auto written = proto::write_mesh_file(line.out, surface, {}); !written) Spec::fail(written.problem().line());
}

}  // namespace

int main(int argc, char** argv) {
  const Line line = line_of(argc, argv);
  const HeightMesh mesh = mesh_of(line);
  std::printf("[");
  for (std::size_t k = 0; k < line.specs.size(); ++k) {
    std::printf(k ? ",\n" : "\n");
    print_row(mesh, line, line.specs[k]);
  }
  std::printf("\n]\n");
  return 0;
}
