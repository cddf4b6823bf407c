#include "server/cli/simplify_report.h"

#include <cstdio>

#include "server/http/json.h"

namespace cordillera::server {
namespace {

std::string type_name(const proto::MeshEncoding& encoding) {
  return encoding.coordinates == proto::CoordinateType::float32 ? "float32" : "float64";
}

/// 0.388, 0.00148 and 18.7: three digits are what an error is worth.
std::string digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string fixed(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string counts(std::uint64_t vertices, std::uint64_t triangles) {
  return std::to_string(vertices) + " vertices, " + std::to_string(triangles) + " triangles";
}

double success_percent(const gpu::cleap::Report& report) {
  const std::uint64_t tried = report.tried();
  return tried > 0 ? 100.0 * static_cast<double>(report.collapses) / static_cast<double>(tried) : 0;
}

/// f(name, how many) of all ways in which a candidate did not collapse.
template <class F>
void each_discard(const gpu::cleap::Report& report, const F& f) {
  for (auto k = static_cast<std::size_t>(gpu::cleap::Fate::gone); k < gpu::cleap::kFates; ++k) {
    f(gpu::cleap::name_of(static_cast<gpu::cleap::Fate>(k)), report.fates[k]);
  }
}

void add_published(Json& json, const gpu::cleap::Report& report) {
  json["collapses"] = report.collapses;
  json["iterations"] = report.iterations;
  json["passes"] = report.passes;
  json["candidates"] = report.tried();
  json["success_percent"] = success_percent(report);
  Json discards = Json::object();
  each_discard(report, [&](const char* name, std::uint64_t count) { discards[name] = count; });
  json["discards"] = discards;
  Json phases = Json::array();
  for (const auto& phase : report.phases) phases.push_back(Json{{"name", phase.name}, {"seconds", phase.seconds}});
  json["phases"] = phases;
}

std::string published_lines(const gpu::cleap::Report& report) {
  std::string text = "collapses " + std::to_string(report.collapses) + " in " + std::to_string(report.iterations);
  text += " iterations and ";
  text += std::to_string(report.passes) + (report.passes == 1 ? " pass; " : " passes; ") + digits(success_percent(report));
  text += " % of " + std::to_string(report.tried()) + " candidates\ndiscards ";
  each_discard(report, [&](const char* name, std::uint64_t count) {
    text.append(" ").append(name).append(" ").append(std::to_string(count));
  });
  text += "\nphases   ";
  for (const auto& phase : report.phases) text += " " + phase.name + " " + fixed(phase.seconds) + " s,";
  return text.substr(0, text.size() - 1) + "\n";
}

}  // namespace

std::string report_json(const SimplifyReport& report) {
  Json stages = Json::array();
  for (const auto& stage : report.simplified.stages) stages.push_back(Json{{"name", stage.name}, {"seconds", stage.seconds}});
  Json json{{"input", report.input},
            {"strategy", report.strategy},
            {"input_format", proto::name_of(report.source.format)},
            {"input_vertices", report.input_vertices},
            {"input_triangles", report.input_triangles},
            {"joined_vertices", report.joined_vertices},
            {"output", report.output},
            {"output_format", proto::name_of(report.written.format)},
            {"output_coordinates", type_name(report.written)},
            {"vertices", report.simplified.vertices},
            {"triangles", report.simplified.triangles},
            {"rmse_m", report.error.rmse},
            {"max_error_m", report.error.max},
            {"max_error_vertex", report.error.worst},
            {"uncovered_vertices", report.error.uncovered},
            {"turned_triangles", report.turned_triangles},
            {"read_seconds", report.read_seconds},
            {"simplify_seconds", report.simplified.seconds},
            {"simplify_cpu_seconds", report.cpu_seconds},
            {"write_seconds", report.write_seconds},
            {"device", report.simplified.device},
            {"stages", stages}};
  if (report.cleap) add_published(json, *report.cleap);
  return dump(json) + "\n";
}

std::string report_table(const SimplifyReport& report) {
  const gpu::fit::MeshReport& simplified = report.simplified;
  const double share = 100.0 * static_cast<double>(simplified.triangles) / static_cast<double>(report.input_triangles);
  std::string text = "input     " + report.input + ": " + proto::name_of(report.source.format) + ", ";
  text += counts(report.input_vertices, report.input_triangles) + "\n";
  if (report.joined_vertices > 0)
    text += "joined    " + std::to_string(report.joined_vertices) + " vertices that stand where another one does\n";
  text += "output    " + report.output + ": " + proto::name_of(report.written.format) + ", " + type_name(report.written) + ", ";
  text += counts(simplified.vertices, simplified.triangles) + " (" + digits(share) + " %)\n";
  text += "error     rmse " + digits(report.error.rmse) + " m, greatest " + digits(report.error.max) + " m at vertex ";
  text += std::to_string(report.error.worst) + " of the input\n";
  if (report.error.uncovered > 0) {
    text += "beside    " + std::to_string(report.error.uncovered) + " vertices of the input are not above or below the result\n";
  }
  if (report.turned_triangles > 0)
    text += "folded    " + std::to_string(report.turned_triangles) + " triangles of the result are turned over\n";
  if (report.cleap) text += published_lines(*report.cleap);
  text += "time      " + fixed(simplified.seconds) + " s on " + simplified.device + "; reading " + fixed(report.read_seconds);
  return text + " s, writing " + fixed(report.write_seconds) + " s\n";
}

}  // namespace cordillera::server
