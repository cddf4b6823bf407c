// Samples that are kept for a check are the raster's, wherever they are asked for, and each is made once.
#include "pipeline/check/known_samples.h"

#include <algorithm>
#include <cstdint>

#include <gtest/gtest.h>

#include "proto/integers.h"

namespace cordillera::pipeline {
namespace {

using Window = raster::Source::Window;

constexpr proto::Lattice kAsked{3};

/// A height that tells its vertex; counts what it is asked for, and cannot be read at one vertex.
class Counting final : public raster::Source {
 public:
  explicit Counting(const Window& all, std::int64_t damaged_column = INT64_MAX) : all_(all), damaged_column_(damaged_column) {}

  const proto::Source& description() const override { return description_; }
  Window window(const proto::Lattice&) const override { return all_; }
  proto::Result<proto::Samples> sample(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int32_t columns,
                                       std::int32_t rows) override {
    EXPECT_GE(south, 0);
    EXPECT_LE(south + rows - 1, lattice.rows());
    if (west <= damaged_column_ && damaged_column_ < west + columns) return proto::Problem{"raster-unreadable", "", "", ""};
    proto::Samples samples = raster::void_samples({west, south, west + columns - 1, south + rows - 1});
    for (std::size_t k = 0; k < samples.height.size(); ++k) {
      const std::int64_t i = west + static_cast<std::int64_t>(k) % columns, j = south + static_cast<std::int64_t>(k) / columns;
      samples.height[k] = static_cast<std::int32_t>(proto::modulo(i, lattice.columns()) + 10000 * j);
      samples.flat_water[k] = static_cast<std::uint8_t>((i + j) & 1);
    }
    asked_ += samples.height.size();
    return samples;
  }
  std::size_t asked() const { return asked_; }

 private:
  proto::Source description_;
  Window all_;
  std::int64_t damaged_column_;
  std::size_t asked_ = 0;
};

void expect_same(check::KnownSamples& known, Counting&& plain, const Window& w) {
  const auto kept = known.sample(w);
  const auto own = plain.sample(kAsked, w.west, w.south, static_cast<std::int32_t>(w.east - w.west + 1),
                                static_cast<std::int32_t>(w.north - w.south + 1));
  ASSERT_TRUE(kept.ok() && own.ok());
  EXPECT_EQ(kept->west, own->west);
  EXPECT_EQ(kept->south, own->south);
  EXPECT_EQ(kept->columns, own->columns);
  EXPECT_EQ(kept->rows, own->rows);
  EXPECT_EQ(kept->height, own->height);
  EXPECT_EQ(kept->flat_water, own->flat_water);
}

TEST(KnownSamples, AreMadeOnceAndAreThoseOfTheSource) {
  const Window all{0, 0, kAsked.columns() - 1, kAsked.rows()};
  Counting source(all);
  check::KnownSamples known(source, kAsked);
  for (const Window& w : {Window{300, 500, 700, 900}, Window{299, 499, 701, 901}, Window{512, 512, 512, 512},
                          Window{0, 0, 40, 40}, Window{-30, kAsked.rows() - 5, 30, kAsked.rows()}})
    expect_same(known, Counting(all), w);
  known.sample(all).value();
  const std::size_t once = source.asked();
  EXPECT_LE(once, static_cast<std::size_t>((kAsked.columns() + 2 * 256) * (kAsked.rows() + 1)));
  known.sample(all).value();
  known.sample({300, 500, 700, 900}).value();
  EXPECT_EQ(source.asked(), once);
}

TEST(KnownSamples, AreReadBesideDamage) {
  const Window all{0, 0, kAsked.columns() - 1, kAsked.rows()};
  Counting source(all, 600);
  check::KnownSamples known(source, kAsked);
  expect_same(known, Counting(all), {601, 10, 700, 20});
  EXPECT_FALSE(known.sample({600, 10, 700, 20}).ok());
}

/// Three rows of squares over it would have no room, and be made again for each row of tiles.
TEST(KnownSamples, OfAVeryWideRasterAreNotKept) {
  Counting source({0, 0, std::int64_t{1} << 28, 10});
  check::KnownSamples known(source, kAsked);
  known.sample({300, 0, 309, 9}).value();
  EXPECT_EQ(source.asked(), 100u);
}

}  // namespace
}  // namespace cordillera::pipeline
