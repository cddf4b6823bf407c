#include "server/simplify_report.h"

#include <cstdio>

#include "server/json.h"

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

}  // namespace

std::string report_json(const SimplifyReport& report) {
  Json stages = Json::array();
  for (const auto& stage : report.simplified.stages) stages.push_back(Json{{"name", stage.name}, {"seconds", stage.seconds}});
  const Json json{{"input", report.input},
                  {"input_format", proto::name_of(report.source.format)},
                  {"input_vertices", report.input_vertices},
                  {"input_triangles", report.input_triangles},
                  {"output", report.output},
                  {"output_format", proto::name_of(report.written.format)},
                  {"output_coordinates", type_name(report.written)},
                  {"vertices", report.simplified.vertices},
                  {"triangles", report.simplified.triangles},
                  {"rmse_m", report.error.rmse},
                  {"max_error_m", report.error.max},
                  {"max_error_vertex", report.error.worst},
                  {"uncovered_vertices", report.error.uncovered},
                  {"read_seconds", report.read_seconds},
                  {"simplify_seconds", report.simplified.seconds},
                  {"simplify_cpu_seconds", report.cpu_seconds},
                  {"write_seconds", report.write_seconds},
                  {"device", report.simplified.device},
                  {"stages", stages}};
  return dump(json) + "\n";
}

std::string report_table(const SimplifyReport& report) {
  const gpu::fit::MeshReport& simplified = report.simplified;
  const double share = 100.0 * static_cast<double>(simplified.triangles) / static_cast<double>(report.input_triangles);
  std::string text = "input     " + report.input + ": " + proto::name_of(report.source.format) + ", ";
  text += counts(report.input_vertices, report.input_triangles) + "\n";
  text += "output    " + report.output + ": " + proto::name_of(report.written.format) + ", " + type_name(report.written) + ", ";
  text += counts(simplified.vertices, simplified.triangles) + " (" + digits(share) + " %)\n";
  text += "error     rmse " + digits(report.error.rmse) + " m, greatest " + digits(report.error.max) + " m at vertex ";
  text += std::to_string(report.error.worst) + " of the input\n";
  if (report.error.uncovered > 0) {
    text += "beside    " + std::to_string(report.error.uncovered) + " vertices of the input are not above or below the result\n";
  }
  text += "time      " + fixed(simplified.seconds) + " s on " + simplified.device + "; reading " + fixed(report.read_seconds);
  return text + " s, writing " + fixed(report.write_seconds) + " s\n";
}

}  // namespace cordillera::server
