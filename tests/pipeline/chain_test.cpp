#include "pipeline/tile/chain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

using proto::kNoHeight;
using proto::Lattice;

constexpr ChainRule kExact{0.0, 0, 0};

Lattice lattice_of(int finest) { return {finest}; }

Edge edge(const Lattice& lattice, std::int64_t units, Along along = Along::east) {
  return {&lattice, lattice.columns() / 3, lattice.rows() * 3 / 4, along, units};
}

// One sample a character: '.' void, a digit its height in metres.
std::vector<std::int32_t> drawn(const std::string& picture) {
  std::vector<std::int32_t> heights;
  for (const char c : picture) heights.push_back(c == '.' ? kNoHeight : (c - '0') * 1024);
  return heights;
}

// The same way round: what stays, as a picture.
std::string picture_of(const Chain& chain) {
  std::string picture(static_cast<std::size_t>(chain.position.back() + 1), '-');
  for (std::size_t k = 0; k < chain.position.size(); ++k)
    picture[chain.position[k]] = chain.height[k] == kNoHeight ? '.' : static_cast<char>('0' + chain.height[k] / 1024);
  return picture;
}

std::string thinned(const std::string& picture, const ChainRule& rule) {
  const Lattice lattice = lattice_of(22);
  const auto heights = drawn(picture);
  return picture_of(chain_finest(edge(lattice, static_cast<std::int64_t>(heights.size()) - 1), heights, rule));
}

/// Of the western/southern half (a) and the eastern/northern half (b) of an edge.
Chain chain_parent(const Edge& edge, const Chain& a, const Chain& b, const EdgeHeights& heights, const ChainRule& rule) {
  Chain both = a;
  for (std::size_t k = 1; k < b.position.size(); ++k) {
    both.position.push_back(b.position[k] + a.position.back());
    both.height.push_back(b.height[k]);
  }
  return simplify_chain(edge, both, heights, rule);
}

TEST(Chain, WhatOneWouldDraw) {
  const ChainRule metre{0.5, 0, 0};
  EXPECT_EQ(thinned("33333333333333333", metre), "3---------------3");
  EXPECT_EQ(thinned("33333333933333333", metre), "3------393------3");
  EXPECT_EQ(thinned("01234567876543210", metre), "0-------8-------0");
  EXPECT_EQ(thinned(".................", metre), ".---------------.");
  EXPECT_EQ(thinned("3333......3333333", metre), "3--3----.-3-----3");
  EXPECT_EQ(thinned("....33333333.....", metre), ".---3------3----.");
  EXPECT_EQ(thinned("........3........", metre), ".-------3-------.");
}

TEST(Chain, ShortRunsVanish) {
  const ChainRule rim{0.5, 4, 0};
  EXPECT_EQ(thinned("333.3333333333333", rim), "3---------------3");
  EXPECT_EQ(thinned("333...33333333333", rim), "3-3-.-3---------3");
  EXPECT_EQ(thinned("...3333..........", rim), ".---------------.");
  EXPECT_EQ(thinned("...33333.........", rim), ".--3---3--------.");
  EXPECT_EQ(thinned("33..............3", rim), "33------.-------3");
  EXPECT_EQ(thinned("...333..333......", rim), ".--3------3-----.") << "a small hole joins what it parts";
  const Lattice lattice = lattice_of(22);
  EXPECT_EQ(chain_finest(edge(lattice, 16), drawn("333.33333..333333"), rim).dropped_runs, 2u);
}

TEST(Chain, GapsAreBounded) {
  EXPECT_EQ(thinned("33333333333333333", {0.5, 0, 4}), "3---3---3---3---3");
  EXPECT_EQ(thinned("33333333.........", {0.5, 0, 3}), "3--3-3-3--------.");
}

std::vector<std::int32_t> terrain(std::mt19937& random, std::size_t count, int void_share) {
  std::vector<std::int32_t> heights(count);
  double h = 500, slope = 0;
  bool none = false;
  for (std::int32_t& sample : heights) {
    slope += (static_cast<double>(random() % 2001) - 1000) / 2000.0 - slope * 0.05;
    h += slope;
    if (random() % 23 == 0) none = static_cast<int>(random() % 10) < void_share;
    sample = none ? kNoHeight : static_cast<std::int32_t>(h * 1024);
  }
  return heights;
}

bool subset(const Chain& small, const Chain& large, std::int32_t offset) {
  for (std::size_t k = 0; k < small.position.size(); ++k) {
    const std::int32_t p = small.position[k] - offset;
    if (p < 0 || p > large.position.back()) continue;
    const auto found = std::lower_bound(large.position.begin(), large.position.end(), p);
    if (found == large.position.end() || *found != p) return false;
    if (large.height[static_cast<std::size_t>(found - large.position.begin())] != small.height[k]) return false;
  }
  return true;
}

TEST(Chain, ParentsAreNested) {
  std::mt19937 random(3);
  std::size_t dropped = 0;
  for (int round = 0; round < 60; ++round) {
    const Lattice lattice = lattice_of(12);
    const std::int64_t units = 64;
    const auto heights = terrain(random, 8 * units + 1, round % 10);
    std::vector<Chain> level;
    for (int k = 0; k < 8; ++k) {
      Edge e = edge(lattice, units, round % 2 ? Along::north : Along::east);
      (round % 2 ? e.row : e.column) += k * units;
      level.push_back(chain_finest(
          e, std::span<const std::int32_t>(heights.data() + k * units, static_cast<std::size_t>(units + 1)), {1, 1, 16}));
    }
    for (int step = 1; step <= 3; ++step) {
      std::vector<Chain> next;
      const std::int64_t span = units << step;
      for (std::size_t k = 0; k + 1 < level.size(); k += 2) {
        Edge e = edge(lattice, span, round % 2 ? Along::north : Along::east);
        (round % 2 ? e.row : e.column) += static_cast<std::int64_t>(k / 2) * span;
        const std::span<const std::int32_t> samples(heights.data() + (k / 2) * span, static_cast<std::size_t>(span + 1));
        const ChainRule rule{std::ldexp(1.0, step), 1 << step, 16 << step};
        next.push_back(chain_parent(e, level[k], level[k + 1], step < 3 ? samples : std::span<const std::int32_t>{}, rule));
        const Chain& parent = next.back();
        EXPECT_TRUE(subset(parent, level[k], 0));
        EXPECT_TRUE(subset(parent, level[k + 1], static_cast<std::int32_t>(span / 2)));
        EXPECT_EQ(parent.position.front(), 0);
        EXPECT_EQ(parent.position.back(), span);
        EXPECT_TRUE(std::is_sorted(parent.position.begin(), parent.position.end()));
        dropped += level[k].position.size() + level[k + 1].position.size() - 1 - parent.position.size();
      }
      level = next;
    }
  }
  EXPECT_GT(dropped, 1000u) << "nothing was left out: the test shows nothing";
}

// The distance by another way: the point of the chord nearest to the vertical line, by golden sections.
double distance_by_search(proto::Vec3 a, proto::Vec3 b, proto::Vec3 s, proto::Vec3 up) {
  const auto off = [&](double r) {
    const proto::Vec3 d = a + r * (b - a) - s;
    const double t = dot(d, up);
    const proto::Vec3 aside = d - t * up;
    return std::pair<double, double>(dot(aside, aside), std::abs(t));
  };
  double low = 0, high = 1;
  for (int k = 0; k < 200; ++k) {
    const double l = low + (high - low) * 0.382, h = low + (high - low) * 0.618;
    (off(l).first < off(h).first ? high : low) = off(l).first < off(h).first ? h : l;
  }
  return off((low + high) / 2).second;
}

TEST(Chain, NoSampleIsFartherThanTolerated) {
  std::mt19937 random(5);
  for (int round = 0; round < 24; ++round) {
    const Lattice lattice = lattice_of(round % 3 ? 6 : 11);  // at level 6 the earth's curvature rules
    const bool north = round % 2, to_pole = round % 4 == 3;  // some vertices stay there, whatever lies between
    Edge e = edge(lattice, 512, north ? Along::north : Along::east);
    if (to_pole) e.row = lattice.rows() - 512;
    const auto heights = terrain(random, 513, 0);
    const double tolerance = 0.5 * (1 + round);
    ChainRule rule{tolerance, 0, 0};
    if (to_pole) rule.void_gap_units = 8;
    const Chain chain = chain_finest(e, heights, rule);
    const auto rows = proto::row_frames(lattice, e.row, 513);
    const auto columns = proto::column_frames(lattice, e.column, 513);
    const auto at = [&](std::int32_t p) { return proto::ecef(rows[north ? p : 0], columns[north ? 0 : p], heights[p] / 1024.0); };
    double worst = 0;
    for (std::size_t k = 0; k + 1 < chain.position.size(); ++k)
      for (std::int32_t p = chain.position[k] + 1; p < chain.position[k + 1]; ++p)
        worst = std::max(worst, distance_by_search(at(chain.position[k]), at(chain.position[k + 1]), at(p),
                                                   proto::normal(rows[north ? p : 0], columns[north ? 0 : p])));
    EXPECT_LE(worst, tolerance * (1 + 1e-6));
    EXPECT_GT(worst, tolerance / 20);
    EXPECT_LT(chain.position.size(), 400u);
  }
}

TEST(Chain, AFlatSeaIsCurved) {
  const Lattice lattice = lattice_of(6);
  const std::vector<std::int32_t> sea(257, 0);
  // 256 cells of 180 / 16384 degrees: 313 km at the equator, a sagitta of 1921 m. Pieces half as long sag a quarter of it.
  const Edge equator{&lattice, 0, lattice.rows() / 2, Along::east, 256};
  EXPECT_EQ(chain_finest(equator, sea, {2000, 0, 0}).position.size(), 2u);
  EXPECT_EQ(chain_finest(equator, sea, {1000, 0, 0}).position, (std::vector<std::int32_t>{0, 128, 256}));
  EXPECT_EQ(chain_finest(equator, sea, {300, 0, 0}).position, (std::vector<std::int32_t>{0, 64, 128, 192, 256}));
}

TEST(Chain, BothTilesSeeTheSame) {
  std::mt19937 random(7);
  const Lattice lattice = lattice_of(4);
  const auto heights = terrain(random, 257, 3);
  const std::int32_t last = proto::tiles_across(4) - 1;
  const ChainRule rule{3, 1, 64};
  const auto chain = [&](proto::TileAddress t, Side side) { return chain_finest(edge_of(lattice, t, side), heights, rule); };
  EXPECT_TRUE(chain({4, 5, 7}, Side::east) == chain({4, 6, 7}, Side::west));
  EXPECT_TRUE(chain({4, 5, 7}, Side::north) == chain({4, 5, 8}, Side::south));
  EXPECT_TRUE(chain({4, last, 7}, Side::east) == chain({4, 0, 7}, Side::west)) << "at the antimeridian";
  EXPECT_FALSE(chain({4, 5, 7}, Side::north) == chain({4, 5, 15}, Side::north)) << "curvature is not seen";
}

TEST(Chain, HoldsOnToRimsBeside) {
  const Lattice lattice = lattice_of(22);
  const std::vector<std::int32_t> heights = drawn("33333333333333333");
  const std::string beside = "       44441     ";
  std::vector<std::int32_t> to_void;
  for (const char c : beside) to_void.push_back(c == ' ' ? 5 : c - '0');
  EdgeHeights seen(heights);
  seen.to_void = to_void;
  seen.reach = 4;
  EXPECT_EQ(picture_of(chain_finest(edge(lattice, 16), seen, {0.5, 0, 0})), "3-----33--333---3");
  seen.cell = 2;
  EXPECT_EQ(picture_of(chain_finest(edge(lattice, 16), seen, {0.5, 0, 0})), "3-----33--333---3") << "a cell further on";
  seen.reach = 2;
  EXPECT_EQ(picture_of(chain_finest(edge(lattice, 16), seen, {0.5, 0, 0})), "3---------333---3");
}

TEST(Chain, PolesHaveEdgesWithoutLength) {
  const Lattice lattice = lattice_of(4);
  const std::vector<std::int32_t> pole(257, 1024 * 2800);
  const Chain chain = chain_finest(edge_of(lattice, {4, 3, 0}, Side::south), pole, {1, 0, 0});
  EXPECT_EQ(chain.position, (std::vector<std::int32_t>{0, 256}));
}

TEST(Chain, TheLongestEdgeNeedsNoTable) {
  const Lattice lattice = lattice_of(22);
  const std::int32_t half = 1 << 29;
  const Chain child{{0, half / 2, half}, {0, 5000 * 1024, 0}, 0};
  const Chain parent = chain_parent(edge_of(lattice, {0, 0, 0}, Side::east), child, child, {}, {1e7, 0, 0});
  EXPECT_EQ(parent.position, (std::vector<std::int32_t>{0, 2 * half}));
  const Chain exact = chain_parent(edge_of(lattice, {0, 0, 0}, Side::east), child, child, {}, kExact);
  EXPECT_EQ(exact.position.size(), 5u);
}

}  // namespace
}  // namespace cordillera::pipeline
