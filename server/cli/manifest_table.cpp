#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <iostream>

#include "pipeline/tileset/manifest_json.h"
#include "proto/utf8.h"
#include "server/cli/commands.h"
#include "server/cli/progress_bar.h"
#include "server/options/spoken_words.h"

namespace cordillera::server {
namespace {

__attribute__((format(printf, 1, 2))) std::string text(const char* format, ...) {
  char line[512];
  va_list arguments;
  va_start(arguments, format);
  const int length = std::vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  return std::string(line, static_cast<std::size_t>(std::min<int>(length, sizeof line - 1)));
}

/// A manifest may be anybody's: what a terminal would obey is left out.
std::string masked(const std::string& words) { return proto::one_line(words); }

std::string bytes_text(double bytes) {
  if (bytes < 1e4) return text("%.0f B", bytes);
  if (bytes < 1e7) return text("%.0f kB", bytes / 1e3);
  return bytes < 1e10 ? text("%.0f MB", bytes / 1e6) : text("%.0f GB", bytes / 1e9);
}

/// How voids are told. A raster that declares no value for them may have some all the same: what is beyond the limit, or beside
/// it.
std::string nodata_text(const proto::Source& source) {
  return source.nodata() == "none" ? "none declared" : text("%.100s", masked(source.nodata()).c_str());
}

/// Where it lies, as bbox= takes it, and how large its pixels are on the ground.
std::string place_line(const proto::Source& source) {
  constexpr int kSides = 4;
  if (source.bbox_size() < kSides) return "";
  std::string out = text("bbox      %.5f,%.5f,%.5f,%.5f (west, south, east, north)", source.bbox(0), source.bbox(1),
                         source.bbox(2), source.bbox(3));
  if (source.pixel_width_m() > 0)
    out += text(", pixels of %.4g x %.4g m on the ground", source.pixel_width_m(), source.pixel_height_m());
  return out + "\n";
}

std::string source_lines(const proto::Manifest& manifest) {
  const proto::Source& source = manifest.source();
  std::string out = text("source    %.200s:", masked(source.file()).c_str());
  if (pipeline::has_one_size(manifest))
    out += text("%s %u x %u", manifest.sources_size() > 1 ? " each" : "", source.columns(), source.rows());
  out += text(" %s, %s\n", masked(source.data_type()).c_str(), masked(source.driver()).c_str());
  out += text("crs       %.300s (%s)\n", masked(source.crs()).c_str(), masked(source.crs_from()).c_str());
  out += place_line(source);
  const bool other = !source.vertical_datum_declared().empty() && source.vertical_datum_declared() != source.vertical_datum();
  out += text("heights   above %.200s (%s%s%.200s%s%.200s), unit %.50s\n", masked(source.vertical_datum()).c_str(),
              masked(source.vertical_datum_from()).c_str(), source.vertical_grid().empty() ? "" : ", by ",
              masked(source.vertical_grid()).c_str(), other ? "; the raster declares " : "",
              other ? masked(source.vertical_datum_declared()).c_str() : "", masked(source.unit()).c_str());
  return out;
}

/// What stores of earlier versions know less of.
std::string pixels_line(const proto::Source& source) {
  if (!source.has_error_at_pixels())
    return source.has_resampling_error() ? text("pixels    resampling error %.3f m\n", source.resampling_error()) : "";
  const proto::ErrorAtPixels& error = source.error_at_pixels();
  std::string out = text("pixels    at most %.3f m off, rmse %.3f m, 99 %% within %.3f m, at %.0f pixels", error.max(),
                         error.rmse(), error.p99(), error.pixels());
  return out + (error.uncovered() > 0 ? text("; %.0f more are under no triangle\n", error.uncovered()) : "\n");
}

/// With the notes, one of which may say why.
std::string strategy_lines(const proto::Manifest& manifest) {
  std::string out;
  if (const std::string& strategy = manifest.options().strategy(); !strategy.empty())
    out += text("strategy  %.20s\n", masked(strategy).c_str());
  for (const std::string& note : manifest.notes()) out += text("note      %.400s\n", as_typed(masked(note)).c_str());
  return out;
}

/// A figure in metres, or a dash where there is none.
std::string metres_text(double metres, bool known) { return known ? text("%.3f", metres) : "-"; }

std::string level_line(const proto::LevelSummary& level) {
  return text("%5u %7u %10u %11s %10.3f %11s%s %10s\n", level.level(), level.tiles(), level.triangles(),
              bytes_text(level.drc_bytes()).c_str(), level.target(),
              metres_text(level.stated_max_error(), level.tiles() > 0).c_str(), level.composed() ? "*" : " ",
              metres_text(level.rmse(), level.has_rmse()).c_str());
}

}  // namespace

void complain(const proto::Problem& problem) { std::cerr << "cordillera: " << as_typed(problem.line()) << "\n"; }

int fail(const proto::Problem& problem) {
  complain(problem);
  return kFailed;
}

int wrong_usage(const proto::Problem& problem) {
  complain(problem);
  return kUsage;
}

int with_output(int code) {
  if (std::cout.flush()) return code;
  complain({"output-failed", "not all of the output could be written to stdout",
            "a terminal, a program that reads all of it, or a file on a disk with room", ""});
  return code == kDone ? kFailed : code;
}

std::string manifest_table(const proto::Manifest& manifest) {
  const proto::Source& source = manifest.source();
  std::string out = source_lines(manifest);
  out += text("nodata    %s; %.2f %% of the lattice has no height\n", nodata_text(source).c_str(), 100 * source.nodata_share());
  out += strategy_lines(manifest);
  out += text("range     %.2f to %.2f m above the ellipsoid\n", source.min_height(), source.max_height());
  out += pixels_line(source);
  out += text("tiles     %u in levels %u to %u, %u triangles, %s; cell %.2f m", manifest.tiles(), manifest.min_level(),
              manifest.max_level(), manifest.triangles(), bytes_text(manifest.bytes()).c_str(), manifest.cell_m());
  if (!manifest.device().empty()) out += text("; built on %.200s", masked(manifest.device()).c_str());
  out += "\n";
  out += "\nlevel   tiles  triangles        .drc   target m  max error m     rmse m\n";
  bool composed = false;
  for (const proto::LevelSummary& level : manifest.levels()) {
    out += level_line(level);
    composed = composed || level.composed();
  }
  return composed ? out + "* a bound for every sample, from finer levels; the others are measured\n" : out;
}

std::string estimate_table(const proto::Manifest& manifest, double seconds, const std::optional<raster::ValueLook>& values) {
  const bool shares = manifest.options().keep_size() > 0;
  std::string out = source_lines(manifest);
  out += text("nodata    %s\n", nodata_text(manifest.source()).c_str());
  if (values) out += text("values    %.300s\n", raster::text_of(*values, manifest.source().vertical_datum()).c_str());
  out += strategy_lines(manifest);
  out += text("tiles     about %u in levels %u to %u, %u triangles, %s; cell %.2f m\n", manifest.tiles(), manifest.min_level(),
              manifest.max_level(), manifest.triangles(), bytes_text(manifest.bytes()).c_str(), manifest.cell_m());
  out += "\nlevel  ~tiles ~triangles       ~.drc   target m\n";
  for (const proto::LevelSummary& level : manifest.levels()) {
    out += text("%5u %7u %10u %11s %10s\n", level.level(), level.tiles(), level.triangles(),
                bytes_text(level.drc_bytes()).c_str(), metres_text(level.target(), !shares).c_str());
  }
  out += "dry run: nothing was built. Levels" + std::string(shares ? "" : " and targets") + " are those of the build.\n";
  out += "What has a ~ is a guess from a few tiles that were built and thrown away, and so is the time: " +
         std::string(std::lround(seconds) < 1 ? "" : "about ") + duration_text(seconds) + " on " +
         std::to_string(manifest.options().threads()) + (manifest.options().threads() == 1 ? " thread" : " threads") + ".\n";
  out += "Errors are measured when tiles are built.\n";
  return out;
}

}  // namespace cordillera::server
