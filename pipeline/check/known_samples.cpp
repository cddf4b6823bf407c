#include "pipeline/check/known_samples.h"

#include <algorithm>
#include <cstddef>

#include "proto/integers.h"

namespace cordillera::pipeline::check {
namespace {

using Window = raster::Source::Window;
using proto::floor_divide;

constexpr std::int64_t kSide = 256;
constexpr std::size_t kSampleBytes = sizeof(std::int32_t) + sizeof(std::uint8_t);
constexpr std::size_t kMostBytes = std::size_t{512} << 20;

proto::Result<proto::Samples> read(raster::Source& source, const proto::Lattice& lattice, const Window& w) {
  return source.sample(lattice, w.west, w.south, static_cast<std::int32_t>(w.east - w.west + 1),
                       static_cast<std::int32_t>(w.north - w.south + 1));
}

/// What both have.
void copy(const proto::Samples& from, proto::Samples& to) {
  const std::int64_t west = std::max(from.west, to.west), east = std::min(from.west + from.columns, to.west + to.columns);
  const std::int64_t south = std::max(from.south, to.south), north = std::min(from.south + from.rows, to.south + to.rows);
  for (std::int64_t j = south; j < north; ++j) {
    const std::ptrdiff_t source = (j - from.south) * from.columns + (west - from.west),
                         target = (j - to.south) * to.columns + (west - to.west);
    std::copy_n(from.height.begin() + source, east - west, to.height.begin() + target);
    std::copy_n(from.flat_water.begin() + source, east - west, to.flat_water.begin() + target);
  }
}

}  // namespace

KnownSamples::KnownSamples(raster::Source& source, const proto::Lattice& lattice)
    : source_(source), lattice_(lattice), squares_(kMostBytes) {
  const Window all = source.window(lattice);
  keeps_ = static_cast<std::size_t>(all.east - all.west + 2 * kSide) * 3 * kSide * kSampleBytes <= kMostBytes;
}

proto::Result<KnownSamples::Square> KnownSamples::square(std::int64_t column, std::int64_t row) {
  const std::pair key{column, row};
  if (const auto known = squares_.find(key)) return *known;
  const Window w{column * kSide, row * kSide, (column + 1) * kSide - 1, std::min((row + 1) * kSide - 1, lattice_.rows())};
  auto samples = read(source_, lattice_, w);
  if (!samples.ok()) return samples.problem();
  const auto made = std::make_shared<const proto::Samples>(std::move(*samples));
  squares_.keep(key, made, made->height.size() * kSampleBytes);
  return made;
}

proto::Result<proto::Samples> KnownSamples::sample(const Window& window) {
  if (!keeps_) return read(source_, lattice_, window);
  proto::Samples samples = raster::void_samples(window);
  for (std::int64_t row = floor_divide(window.south, kSide); row <= floor_divide(window.north, kSide); ++row) {
    for (std::int64_t column = floor_divide(window.west, kSide); column <= floor_divide(window.east, kSide); ++column) {
      const auto part = square(column, row);
      if (!part.ok()) return read(source_, lattice_, window);  // a square reaches farther, to damage that is nobody's here
      copy(**part, samples);
    }
  }
  return samples;
}

}  // namespace cordillera::pipeline::check
