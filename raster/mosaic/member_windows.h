#pragma once
// Where the members of a mosaic lie, on lattices of every level.
#include <cstdint>
#include <span>

#include "raster/source.h"

namespace cordillera::raster {

/// Lattice whose windows tell where a member of a mosaic lies: windows of coarser lattices follow from it.
inline constexpr proto::Lattice kMemberLattice{proto::kMaxLevel};

/// The lattice vertices of a coarser lattice inside a member's window; empty (west > east) when there are none.
Source::Window coarser(const Source::Window& window, const proto::Lattice& lattice);

/// The window of kMemberLattice that holds places, one or more.
Source::Window around(std::span<const double> longitude_deg, std::span<const double> latitude_deg);

/// The window of kMemberLattice around the middles of all cells of another lattice between the window's vertices.
Source::Window middles_of(const Source::Window& cells, const proto::Lattice& lattice);

/// Whether two windows of a lattice share a vertex; columns are taken modulo the circle.
bool touch(const Source::Window& a, const Source::Window& b, const proto::Lattice& lattice);

/// Whether its heights are those of points, the centres of its pixels.
bool is_of_points(const proto::Source& source);

/// How many vertices of the lattice away the pixels of a member may change a height of another: where both were cut from one
/// grid, the outermost half pixels of one are interpolated to the other's.
std::int64_t reach_beyond(const proto::Source& source, const proto::Lattice& lattice);

/// The same of points alone: how far beyond its window a raster among others may have data. One of points ends at the outermost
/// centres, and data may reach to those of the next raster.
std::int64_t reach_of_points(const proto::Source& source, const proto::Lattice& lattice);

/// A window with so much around it.
Source::Window widened(const Source::Window& window, std::int64_t by);

/// How far a feather reaches, in vertices of the lattice; at most kMostFeather.
int feather_vertices(double feather_m, const proto::Lattice& lattice);
inline constexpr int kMostFeather = 256;

}  // namespace cordillera::raster
