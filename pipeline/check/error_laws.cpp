#include "pipeline/check/error_laws.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "gpu/measure/surface_error.h"
#include "pipeline/build/build.h"
#include "pipeline/check/cover_law.h"
#include "pipeline/encode/draco_mesh.h"
#include "pipeline/finest/pixel_error.h"
#include "pipeline/plan/plan.h"
#include "proto/mesh.h"

namespace cordillera::pipeline::check {
namespace {

std::string metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f m", value);
  return text;
}

}  // namespace

proto::Result<std::unique_ptr<ErrorLaws>> ErrorLaws::open(const OpenRasters& rasters, const proto::Manifest& manifest,
                                                          const proto::Plan& plan) {
  auto source = rasters(manifest);
  if (!source) return source.problem();
  *source = source_of_tiles(plan, std::move(*source));
  proto::Plan known = plan;
  const raster::Source::Window window = (*source)->window(lattice_of(plan));
  known.clear_window();
  for (const std::int64_t bound : {window.west, window.south, window.east, window.north})
    known.add_window(static_cast<std::int32_t>(bound));
  return std::unique_ptr<ErrorLaws>(new ErrorLaws(std::move(*source), std::move(known)));
}

ErrorLaws::ErrorLaws(std::unique_ptr<raster::Source> source, proto::Plan plan)
    : source_(std::move(source)), samples_(*source_, lattice_of(plan)), plan_(std::move(plan)) {}

void ErrorLaws::add(const CheckedTile& tile, double stated_m, Report& report) {
  const proto::Lattice lattice = lattice_of(plan_);
  const raster::Source::Window w = node_window(plan_, tile.tile);
  if (w.west > w.east || w.south > w.north) return report.findings.add(name_of(tile.tile), "it lies outside the raster");
  check_cover(*source_, samples_, plan_, tile, report);
  const std::int64_t columns = w.east - w.west + 1, rows = w.north - w.south + 1;
  if (columns * rows > kBlockSamples) {
    ++report.unmeasured;
    return;
  }
  const auto samples = samples_.sample(w);
  if (!samples) return report.findings.add(name_of(tile.tile), "the raster cannot be read there: " + samples.problem().detail);
  const proto::TileMesh mesh = tile_mesh_of(tile.drc);
  if (tile.tile.z == lattice.finest_level)
    pixels_.add(TilePixels(lattice, tile.tile, mesh.side, pixels_of(lattice, tile.tile, *source_)).errors(mesh));
  gpu::SurfaceErrorInput input;
  input.lattice = &lattice;
  input.tile = tile.tile;
  input.mesh = &mesh;
  input.samples = &*samples;
  input.ecef_steps = ecef_steps(level_plan(plan_, tile.tile.z));
  const gpu::SurfaceError error = gpu::surface_error(input, INFINITY);
  ++report.measured;
  if (error.max_m <= stated_m) return;
  report.findings.add(name_of(tile.tile), "it is " + metres(error.max_m) + " off the raster and states " + metres(stated_m));
}

void ErrorLaws::finish(const proto::Source& stated, Report& report) const {
  if (!stated.has_error_at_pixels()) return;  // an earlier version's
  // Stores of before 28 November 2026 took either of the two triangles that have a pixel on their edge: an RMSE of 329.213 m for
  // 329.211.
  static constexpr double kGrace_m = 1.0 / 1024, kGraceShare = 1e-5;
  const proto::ErrorAtPixels found = pixels_.total();
  const proto::ErrorAtPixels& said = stated.error_at_pixels();
  const auto exceeds = [](double now_m, double said_m) { return now_m > said_m + std::max(kGrace_m, kGraceShare * said_m); };
  if (exceeds(found.max(), said.max()) || exceeds(found.rmse(), said.rmse()))
    report.findings.add("pixels", "the finest level is " + metres(found.max()) + " off the raster's pixels, RMSE " +
                                      metres(found.rmse()) + ", and " + metres(said.max()) + ", RMSE " + metres(said.rmse()) +
                                      ", are stated");
  if (found.pixels() != said.pixels())
    report.findings.add("pixels", std::to_string(static_cast<std::uint64_t>(found.pixels())) +
                                      " of the raster's are under a triangle, and " +
                                      std::to_string(static_cast<std::uint64_t>(said.pixels())) + " are stated");
}

}  // namespace cordillera::pipeline::check
