#pragma once
// Simplifies any height-field mesh to a given number of triangles, or within a given error, as accurately as the count allows. It
// is not tied to tiles. Vertices of the result are free: they lie where they make the error least, on a fine lattice in the plan.
//
// The work is the wave-parallel one of this folder's README; CPU and CUDA give the same bits. The papers behind it:
//   P. Lindstrom, G. Turk, Fast and memory efficient polygonal simplification, 1998: collapse at the optimum of a memoryless
//   quadric M. Garland, P. Heckbert, Fast polygonal approximation of terrains and height fields, 1995: insertion of the worst
//   sample M. Jones, P. Plassmann, A parallel graph coloring heuristic, 1993: which vertices may move at the same time L. Nadler,
//   Piecewise linear best L2 approximation on triangulations, 1986: vertices that follow the data
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "proto/result.h"
#include "proto/stop_watch.h"

namespace cordillera::gpu::fit {

/// A triangulated height field: no two points of the surface lie above each other.
struct HeightMesh {
  /// Indexed by vertex; three arrays of one length. x and y span the plan, z is up; all in the same unit, say metres (x and y may
  /// have another one, for errors are measured along z). Finite. No two vertices share their x and y.
  std::vector<double> x, y, z;
  /// Indices of vertices, all counter-clockwise or all clockwise as seen from above; of positive area. Every edge has one or two
  /// triangles, those at a vertex follow each other around it (one fan), and every vertex has some. Holes, several parts and
  /// borders of any shape are allowed; the border stays where it is: a vertex on it goes only where the border runs straight
  /// through it.
  std::vector<std::array<std::uint32_t, 3>> triangles;

  std::size_t vertices() const { return x.size(); }
};

/// How small the result should be: one of three.
struct MeshTarget {
  enum class Kind { triangles, keep, error_m };
  Kind kind = Kind::keep;
  double value = 0.1;

  /// So many triangles, exactly, if the border lets the mesh get there; >= 1. No fewer than the border and one vertex for every
  /// 16 triangles at a vertex need; more than the input has: the input comes back.
  static MeshTarget triangles(std::uint64_t count) { return {Kind::triangles, static_cast<double>(count)}; }
  /// This share of the input's triangles, > 0 and <= 1; rounded to a whole number of them.
  static MeshTarget keep(double share) { return {Kind::keep, share}; }
  /// As few triangles as are found whose surface passes no vertex of the input at more than this along z; >= 0, in the unit of z.
  /// Measured on the result; over it by no more than a float's rounding of heights. 0, and what is less than rounding takes: the
  /// input comes back.
  static MeshTarget error_m(double metres) { return {Kind::error_m, metres}; }
};

enum class Quality {
  fast,      ///< drops and waves only: a quadric decides, never compared with the samples unless sweeps are asked for
  default_,  ///< vertices fitted to the samples, one exchange: the cheapest vertices go, the worst samples come in
  best,      ///< costs from the samples themselves below twice the target, more exchanges: least RMSE
  minimax,   ///< best, then the p-norm of the error lowered: least maximum, for some 10 % more RMSE
};

struct MeshOptions {
  Quality quality = Quality::default_;
  std::string device = "auto";  ///< "auto", "cpu", "cuda", "cuda:N"; auto takes the first CUDA device that works, else the CPU
  unsigned threads = 1;         ///< of a CPU; 0: one for each usable core. The result does not depend on them
  static constexpr int kOfQuality = -1;
  int sweeps = kOfQuality;     ///< how often every vertex is fitted to the samples, if not as often as the quality says
  int exchanges = kOfQuality;  ///< how many, if not what the quality says; ignored for a target in metres
};

struct MeshReport {
  std::uint64_t vertices = 0, triangles = 0;  ///< of the result
  /// Along z, over all vertices of the input, against the result's surface above or below them.
  double rmse_m = 0, max_error_m = 0;
  double seconds = 0;                    ///< simplification, without checks of the input and without the measuring of this report
  std::string device;                    ///< "cpu" or "cuda:0 (NVIDIA …)"
  std::vector<proto::StageTime> stages;  ///< what `seconds` went into, in the order of first use
};

struct SimplifiedMesh {
  /// Counter-clockwise seen from above. Plan positions are whole 16ths of the input's typical cell (finer where the input needs
  /// it), counted from the least x and y of the input; at most 16 edges at a vertex, unless the input has more.
  HeightMesh mesh;
  MeshReport report;
};

/// Same input and options, same result, on every device. The input is only read. Some 450 bytes of memory a vertex are taken,
/// and more where one has many edges, for all have room for as many: four times as much with 248. Inputs up to 2^28 vertices.
/// Refused, with the first offending element named (the lowest index): arrays of unequal length
/// ("mesh-broken"), NaN or infinity ("mesh-not-finite"), an index that is no vertex ("mesh-broken"), a triangle that is a line or
/// turns the other way than the first, a vertex under another part of the surface ("mesh-not-height-field"), an edge of three
/// triangles, a vertex of two fans or of more than 255 edges ("mesh-not-manifold"), a part so far away that the others lie in a
/// few bins ("mesh-too-scattered"), a target out of range or an error that was not reached ("bad-target"), a device that is
/// unknown or cannot be used ("unknown-device", "device-unavailable"). A GPU that fails in mid-work is replaced by the CPU;
/// `report.device` tells.
proto::Result<SimplifiedMesh> simplify(const HeightMesh& mesh, const MeshTarget& target, const MeshOptions& options = {});

}  // namespace cordillera::gpu::fit
