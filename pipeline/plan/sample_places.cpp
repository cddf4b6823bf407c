#include "pipeline/plan/sample_places.h"

#include <algorithm>
#include <cmath>

namespace cordillera::pipeline {
namespace {

constexpr double kMostNodes = 1 << 18;
constexpr std::size_t kMostQuestions = 4096;  // a question to a projected raster takes a tenth of a millisecond
constexpr double kFirstQuestions = 256;       // of rasters far apart

std::uint64_t spaced_bits(std::uint32_t value) {
  std::uint64_t bits = value;
  bits = (bits | bits << 16) & 0x0000ffff0000ffffu;
  bits = (bits | bits << 8) & 0x00ff00ff00ff00ffu;
  bits = (bits | bits << 4) & 0x0f0f0f0f0f0f0f0fu;
  bits = (bits | bits << 2) & 0x3333333333333333u;
  return (bits | bits << 1) & 0x5555555555555555u;
}

std::uint64_t z_curve(const proto::TileAddress& node) {
  return spaced_bits(static_cast<std::uint32_t>(node.x)) | spaced_bits(static_cast<std::uint32_t>(node.y)) << 1;
}

/// No triangle fits: the data ends before the node or on its border.
bool outside(const raster::Source::Window& w) { return w.west >= w.east || w.south >= w.north; }

bool certainly_empty(const proto::Plan& plan, const raster::Source& source, const raster::Source::Window& w) {
  return outside(w) || source.empty(lattice_of(plan), w.west, w.south, w.east - w.west + 1, w.north - w.south + 1);
}

}  // namespace

std::vector<proto::TileAddress> filled_nodes(const proto::Plan& plan, const raster::Source& source, int level) {
  // Rasters far apart have more blocks between them than can be asked for: then larger nodes are asked first, and the level is as
  // fine as what is left allows.
  int from = std::min(level, static_cast<int>(plan.block_level()));
  const bool far_apart = touched_count(plan, from) > kMostQuestions;
  while (far_apart && from > 0 && touched_count(plan, from) > kFirstQuestions) --from;
  while (!far_apart && level > from && touched_count(plan, level) > kMostNodes) --level;
  std::vector<proto::TileAddress> nodes = touched_tiles(plan, from);
  std::size_t questions = 0;
  const auto drop_empty = [&] {
    questions += nodes.size();
    const bool ask = questions <= kMostQuestions;
    std::erase_if(nodes, [&](const auto& node) {
      const raster::Source::Window w = node_window(plan, node);
      return ask ? certainly_empty(plan, source, w) : outside(w);
    });
  };
  drop_empty();
  while (!nodes.empty() && nodes.front().z < level && (!far_apart || 4.0 * static_cast<double>(nodes.size()) <= kMostNodes)) {
    std::vector<proto::TileAddress> children;
    for (const proto::TileAddress& node : nodes) {
      for (int c = 0; c < 4; ++c) children.push_back(node.child(c));
    }
    nodes = std::move(children);
    drop_empty();
  }
  std::sort(nodes.begin(), nodes.end(), [](const auto& a, const auto& b) { return z_curve(a) < z_curve(b); });
  return nodes;
}

std::size_t count_at(std::vector<proto::TileAddress> nodes, int level) {
  if (nodes.empty()) return 0;
  if (level >= nodes.front().z) return nodes.size() << (2 * (level - nodes.front().z));
  for (proto::TileAddress& node : nodes) node = node.at_level(level);
  std::sort(nodes.begin(), nodes.end());
  return static_cast<std::size_t>(std::unique(nodes.begin(), nodes.end()) - nodes.begin());
}

proto::TileAddress node_at(const std::vector<proto::TileAddress>& nodes, std::size_t place, int level) {
  const int down = level - nodes.front().z;
  proto::TileAddress node = nodes[place >> (2 * down)];
  for (int d = down - 1; d >= 0; --d) node = node.child(static_cast<int>(place >> (2 * d) & 3));
  return node;
}

double touched_count(const proto::Plan& plan, int level) {
  const double units = static_cast<double>(lattice_of(plan).tile_units(level));
  const auto across = [&](int from, int to) { return (plan.window(to) - static_cast<double>(plan.window(from))) / units + 2; };
  return across(0, 2) * across(1, 3);
}

std::size_t spread_place(std::size_t k, std::size_t count) {
  constexpr double kGolden = 0.6180339887498949;
  const double at = 0.5 + kGolden * static_cast<double>(k);
  return std::min(count - 1, static_cast<std::size_t>((at - std::floor(at)) * static_cast<double>(count)));
}

std::vector<proto::Samples> sample_places(const proto::Plan& plan, raster::Source& source) {
  std::vector<proto::Samples> seen;
  const proto::Lattice lattice = lattice_of(plan);
  const std::vector<proto::TileAddress> nodes = filled_nodes(plan, source, lattice.finest_level);
  const std::size_t places = count_at(nodes, lattice.finest_level);  // more than nodes, where these are coarser
  for (std::size_t k = 0; k < std::min(kMostSamplePlaces, places); ++k) {
    const std::size_t place = places <= kMostSamplePlaces ? k : spread_place(k, places);
    const raster::Source::Window w = node_window(plan, node_at(nodes, place, lattice.finest_level));
    if (w.west > w.east || w.south > w.north) continue;
    const auto columns = static_cast<std::int32_t>(w.east - w.west + 1), rows = static_cast<std::int32_t>(w.north - w.south + 1);
    auto samples = source.sample(lattice, w.west, w.south, columns, rows);
    if (samples.ok()) seen.push_back(std::move(*samples));
  }
  return seen;
}

}  // namespace cordillera::pipeline
