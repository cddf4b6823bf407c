// Read, simplify, measure, write. What is told of the result is measured here, on the surface as it stands in the file.
#include "server/cli/simplify_command.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <functional>
#include <iostream>
#include <optional>
#include <utility>

#include "gpu/fit/vertical_error.h"
#include "pipeline/threads/workers.h"
#include "proto/mesh_file/join_vertices.h"
#include "proto/mesh_file/mesh_file.h"
#include "proto/stop_watch.h"
#include "server/cli/progress_bar.h"
#include "server/cli/simplify_report.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using proto::CoordinateType;
using proto::TriangleMesh;

/// Asked before the work, which may take minutes.
proto::Result<void> check_output(const std::string& output) {
  if (auto named = proto::encoding_for(output, {}); !named) return named.problem();
  const fs::path folder = fs::path(output).parent_path();
  std::error_code error;
  if (folder.empty() || fs::is_directory(folder, error)) return {};
  return proto::Problem{"output-failed", "there is no folder " + folder.string(), "a file in a folder that can be written",
                        "--output"};
}

/// Triangles that rounding, or smoothing, turned over or made a line.
std::uint64_t turned(const TriangleMesh& mesh) {
  const auto positive = [&](const std::array<std::uint32_t, 3>& t) {
    const double ux = mesh.x[t[1]] - mesh.x[t[0]], uy = mesh.y[t[1]] - mesh.y[t[0]];
    const double vx = mesh.x[t[2]] - mesh.x[t[0]], vy = mesh.y[t[2]] - mesh.y[t[0]];
    return ux * vy - uy * vx > 0;
  };
  return static_cast<std::uint64_t>(std::count_if(mesh.triangles.begin(), mesh.triangles.end(), std::not_fn(positive)));
}

/// The result as it will stand in the file, how, and how far that is from the input.
struct SimplifyOutcome {
  TriangleMesh mesh;
  proto::MeshEncoding encoding;
  gpu::VerticalError error;
};

class Judge {
 public:
  Judge(const gpu::fit::HeightMesh& input, unsigned threads) : points_{input.x, input.y, input.z}, workers_(threads) {}

  SimplifyOutcome outcome(TriangleMesh mesh, const proto::MeshEncoding& encoding) {
    SimplifyOutcome outcome{proto::as_written(std::move(mesh), encoding), encoding, {}};
    outcome.error = gpu::vertical_error(outcome.mesh, points_, workers_.threads(), workers_.loop());
    return outcome;
  }

 private:
  gpu::PointsXyz points_;
  pipeline::Workers workers_;
};

/// Floats if the source had floats and they will do: they may not turn a triangle, nor lose the error that was asked for.
SimplifyOutcome best_outcome(Judge& judge, const TriangleMesh& mesh, proto::MeshEncoding encoding,
                             const gpu::fit::MeshTarget& target) {
  SimplifyOutcome outcome = judge.outcome(mesh, encoding);
  if (encoding.coordinates == CoordinateType::float64) return outcome;
  const bool bound_lost = target.kind == gpu::fit::MeshTarget::Kind::error_m && outcome.error.max > target.value;
  if (!bound_lost && turned(outcome.mesh) == 0) return outcome;
  encoding.coordinates = CoordinateType::float64;
  return judge.outcome(mesh, encoding);
}

std::uint64_t share_of(double keep, std::uint64_t triangles) {
  return static_cast<std::uint64_t>(std::llround(keep * static_cast<double>(triangles)));
}

/// The published algorithm, as the production one would give it back.
proto::Result<gpu::fit::SimplifiedMesh> published(const gpu::fit::HeightMesh& input, CleapRequest request,
                                                  ProgressBar::Style style, SimplifyReport& report) {
  ProgressBar bar(style);
  request.options.progress = [&](std::uint64_t done, std::uint64_t all) {
    proto::Progress progress;
    progress.set_stage("collapse");
    progress.set_done(static_cast<double>(done));
    progress.set_total(static_cast<double>(all));
    progress.set_seconds_left(-1);
    bar.show(progress);
  };
  if (request.keep > 0) request.target.triangles = share_of(request.keep, input.triangles.size());
  auto made = gpu::cleap::simplify(input, request.target, request.options);
  bar.finish();
  if (!made) return made.problem();
  report.cleap = made->report;
  gpu::fit::SimplifiedMesh result;
  result.mesh = std::move(made->mesh);
  if (request.smooth > 0) {
    auto smoothed = gpu::cleap::smooth(result.mesh, request.smooth, request.options.device, request.options.threads);
    if (!smoothed) return smoothed.problem();
    result.mesh = std::move(*smoothed);
  }
  const gpu::cleap::Report& said = *report.cleap;
  result.report.vertices = said.vertices;
  result.report.triangles = said.triangles;
  result.report.seconds = said.seconds();
  result.report.device = said.device;
  result.report.stages = {{"copy", said.copy_seconds},           {"build", said.build_seconds},
                          {"select", said.select_seconds},       {"collapse", said.collapse_seconds},
                          {"rearrange", said.rearrange_seconds}, {"refine", said.refine_seconds}};
  return result;
}

/// How many triangles were asked for; 0: something else was.
std::uint64_t wanted(const SimplifyRequest& request, std::uint64_t input_triangles) {
  using Kind = gpu::fit::MeshTarget::Kind;
  const auto share = [&](double keep) { return std::max<std::uint64_t>(1, share_of(keep, input_triangles)); };
  if (request.cleap) return request.cleap->keep > 0 ? share(request.cleap->keep) : request.cleap->target.triangles;
  if (request.target.kind == Kind::error_m) return 0;
  return request.target.kind == Kind::keep ? share(request.target.value) : static_cast<std::uint64_t>(request.target.value);
}

void warn_of_more(const SimplifyRequest& request, std::uint64_t asked, std::uint64_t reached) {
  if (asked == 0 || reached <= asked) return;
  std::cerr << "cordillera: warning: " << reached << " triangles instead of " << asked << ": "
            << (request.cleap ? "the published algorithm found no further edge to collapse"
                              : "the border stays where it is, and a vertex has at most 16 edges")
            << "\n";
}

gpu::fit::HeightMesh height_mesh(TriangleMesh mesh) {
  return {std::move(mesh.x), std::move(mesh.y), std::move(mesh.z), std::move(mesh.triangles)};
}

/// That of a file, by its name.
proto::Problem problem_of(const std::string& path, proto::Problem problem) {
  problem.detail = path + ": " + problem.detail;
  return problem;
}

int run(const SimplifyLine& line, const SimplifyRequest& request) {
  SimplifyReport report;
  report.input = line.input;
  report.output = line.output;
  proto::StopWatch watch;
  auto file = proto::read_mesh_file(line.input);
  if (!file) return fail(file.problem());
  report.read_seconds = watch.lap();
  TriangleMesh& read = file->mesh;
  report.source = file->encoding;
  report.input_vertices = read.vertices();
  report.input_triangles = read.triangles.size();

  std::optional<TriangleMesh> joined = proto::joined_vertices(read);
  const gpu::fit::HeightMesh input = height_mesh(std::move(read));
  const std::clock_t before = std::clock();
  report.strategy = request.strategy;
  const auto style = ProgressBar::style_of(line.show != Show::json);
  const auto simplified = [&](const gpu::fit::HeightMesh& mesh) {
    return request.cleap ? published(mesh, *request.cleap, style, report)
                         : gpu::fit::simplify(mesh, request.target, request.options);
  };
  if (joined) report.joined_vertices = input.vertices() - joined->vertices();
  auto made = simplified(joined ? height_mesh(*std::exchange(joined, {})) : input);
  if (!made && report.joined_vertices >
                   0) {  // parts that only touch are no manifold as one; and what is wrong is said with the file's own numbers
    report.joined_vertices = 0;
    made = simplified(input);
  }
  if (!made) return fail(problem_of(line.input, made.problem()));
  report.cpu_seconds = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  report.simplified = made->report;
  gpu::fit::HeightMesh& mesh = made->mesh;
  const TriangleMesh result{std::move(mesh.x), std::move(mesh.y), std::move(mesh.z), std::move(mesh.triangles)};
  Judge judge(input, request.threads);
  const SimplifyOutcome outcome = best_outcome(judge, result, *proto::encoding_for(line.output, file->encoding), request.target);
  report.written = outcome.encoding;
  report.error = outcome.error;
  report.turned_triangles = turned(outcome.mesh);
  watch.lap();
  if (auto written = proto::write_mesh_file(line.output, outcome.mesh, outcome.encoding); !written) {
    return fail(written.problem());
  }
  report.write_seconds = watch.lap();
  warn_of_more(request, wanted(request, report.input_triangles), outcome.mesh.triangles.size());
  std::cout << (line.show == Show::json ? report_json(report) : report_table(report)) << std::flush;
  return kDone;
}

}  // namespace

int simplify_command(const SimplifyLine& line) {
  const auto request = simplify_request(line);
  if (!request) return wrong_usage(request.problem());
  if (auto usable = check_output(line.output); !usable) return fail(usable.problem());
  try {
    return run(line, *request);
  } catch (const std::bad_alloc&) {
    return fail({"memory-limit", line.input + " needs more memory than there is", "a smaller mesh or a larger machine", "input"});
  }
}

}  // namespace cordillera::server
