#include "pipeline/bound/composed_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "gpu/measure/surface_error_plane.h"
#include "pipeline/bound/earth.h"
#include "pipeline/bound/loose.h"
#include "pipeline/bound/loose_samples.h"
#include "pipeline/bound/overlay.h"

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;
using proto::Vec3;

// The bound of the curvature is of second order; this covers what it leaves out.
constexpr double kMargin = 1.5;
constexpr std::uint32_t kNone = UINT32_MAX;
constexpr double kRoundingSteps = 2;  // a corner moves by less than a step, and a slope may double it

// A flat triangle, its plane, and heights that it cannot leave (gpu/measure/surface_error_plane.h has the reason).
struct FlatTriangle {
  std::array<Vec3, 3> corner;
  Vec3 normal;  // not of unit length
  gpu::HeightRange range;
};

// What one surface does over a place: of a steep triangle we know the heights between which it is there.
struct Over {
  double low_m = 0, high_m = 0;
  Vec3 slope;              // rise per metre, in the tangent plane
  double along_edges = 0;  // of a steep triangle, instead of the slope: the greatest rise per metre of an edge
};

FlatTriangle plane_of(const Spot& a, const Spot& b, const Spot& c) {
  const Vec3 ab = b.at - a.at, ac = c.at - a.at, bc = c.at - b.at;
  const double edge2_m2 = std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)});
  const auto [low_m, high_m] = std::minmax({a.height_m, b.height_m, c.height_m});
  return {{a.at, b.at, c.at}, cross(ab, ac), gpu::height_range(low_m, high_m, edge2_m2, 0)};
}

// On a pole row two corners are one point: such a triangle shows nothing.
bool has_area(const FlatTriangle& plane) { return dot(plane.normal, plane.normal) > 1e-6; }

// A steep triangle is a needle: no terrain rises so much. Its plane tells little, for the tilt of a needle is one of roundings;
// but across its length it reaches from its longest edge to the others, and these are no steeper than the terrain.
Over over_steep(const FlatTriangle& plane, const SurfacePoint& place) {
  std::array<Vec3, 3> flat;  // seen from the place, along the ground
  for (int k = 0; k < 3; ++k) {
    const Vec3 from = plane.corner[k] - place.at;
    flat[k] = from - dot(from, place.up) * place.up;
  }
  int i = 0;
  const auto length2 = [&](int from, int to) { return dot(flat[to] - flat[from], flat[to] - flat[from]); };
  for (int k = 1; k < 3; ++k)
    if (length2(k, (k + 1) % 3) > length2(i, (i + 1) % 3)) i = k;
  const int j = (i + 1) % 3, tip = (i + 2) % 3;
  const Vec3 along = flat[j] - flat[i];
  const auto share = [&](const Vec3& p) { return std::clamp(dot(p - flat[i], along) / dot(along, along), 0.0, 1.0); };
  const double here = share({}), at_tip = share(flat[tip]);
  const auto height_m = [&](const Vec3& from, const Vec3& to, double t) {
    return dot(from + t * (to - from) - place.at, place.up);
  };
  const auto& c = plane.corner;
  const double first = height_m(c[i], c[j], here);
  const double second = here < at_tip ? height_m(c[i], c[tip], here / at_tip)
                        : at_tip < 1  ? height_m(c[tip], c[j], (here - at_tip) / (1 - at_tip))
                                      : height_m(c[tip], c[tip], 0);
  Over over{std::min(first, second), std::max(first, second), {}, 0};
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const double rise = std::abs(dot(c[next] - c[k], place.up));
    over.along_edges = std::max(over.along_edges, rise / std::sqrt(std::max(length2(k, next), 1e-6)));
  }
  return over;
}

Over over(const FlatTriangle& plane, const SurfacePoint& place) {
  constexpr double kSteepest = 4;
  const double rise = dot(plane.normal, place.up);
  if (rise <= 0 || rise * rise * (1 + kSteepest * kSteepest) < dot(plane.normal, plane.normal)) return over_steep(plane, place);
  const double height_m = plane.range.clamp(dot(plane.normal, plane.corner[0] - place.at) / rise);
  return {height_m, height_m, place.up - (1 / rise) * plane.normal, 0};
}

// The largest distance of two planes over their common ground.
//
// Along a line on the ground, the height of a plane over a sphere of radius R curves by (1 + 2 s^2) / R, s its slope: in the
// difference of two planes the first term cancels. Lines of the lattice are no great circles (a parallel turns by tan(lat) / R a
// metre), which brings in the difference of the slopes. A function that curves by c at most is within c d^2 / 6 of the linear one
// between the corners of a triangle of diameter d.
double farthest_m(const gpu::HeightRange& a, const gpu::HeightRange& b) {
  return std::max(a.high_m - b.low_m, b.high_m - a.low_m);
}

struct Apart {
  double most_m = 0;  // an upper bound
  PlanPoint at;       // the corner of the common ground where they are farthest apart
};

Apart apart(const FlatTriangle& a, const FlatTriangle& b, const Common& ground, const Earth& on) {
  PlanPoint at = ground.corner[0];
  double most = 0, steepest2 = 0, turning = 0, bent = 0, diameter2 = 0;
  std::array<Vec3, 9> corner;
  for (int k = 0; k < ground.count; ++k) {
    const SurfacePoint place = on.place(ground.corner[k]);
    const Over first = over(a, place), second = over(b, place);
    const double here = std::max(first.high_m - second.low_m, second.high_m - first.low_m);
    if (here > most) at = ground.corner[k];
    most = std::max(most, here);
    const Vec3 difference = first.slope - second.slope;
    const double bend = length(difference) + first.along_edges + second.along_edges;
    bent = std::max(bent, bend);
    for (const Over& one : {first, second})
      steepest2 = std::max({steepest2, dot(one.slope, one.slope), one.along_edges * one.along_edges});
    turning = std::max(turning, bend * place.tan_lat);
    corner[k] = place.at;
    for (int j = 0; j < k; ++j) diameter2 = std::max(diameter2, dot(place.at - corner[j], place.at - corner[j]));
  }
  const double radius_m = proto::kSemiMajor_m * (1 - 2 * proto::kFlattening);  // the least radius of curvature there is, about
  const double share = kMargin * diameter2 / (6 * radius_m);
  // Around a pole parallels turn without limit, but no surface departs by more than its slope times the way.
  const double turned = std::min(turning * share, bent * std::sqrt(diameter2));
  return {std::min(farthest_m(a.range, b.range), most + (2 * steepest2 + most / radius_m) * share + turned), at};
}

std::array<gpu::MeshPoint, 3> corners_of(const TileMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  std::array<gpu::MeshPoint, 3> corners;
  for (std::size_t c = 0; c < 3; ++c) corners[c] = {mesh.x[t[c]], mesh.y[t[c]], mesh.height[t[c]]};
  return corners;
}

bool same_place(const gpu::MeshPoint& a, const gpu::MeshPoint& b) { return a.x == b.x && a.y == b.y; }

// A mesh and its patches in one: whoever measures makes no difference.
TileMesh with_patches(const TileMesh& mesh, const TileMesh& patches) {
  TileMesh all = mesh;
  const auto first = static_cast<std::uint32_t>(mesh.vertices());
  all.x.insert(all.x.end(), patches.x.begin(), patches.x.end());
  all.y.insert(all.y.end(), patches.y.begin(), patches.y.end());
  all.height.insert(all.height.end(), patches.height.begin(), patches.height.end());
  all.mark.insert(all.mark.end(), patches.mark.begin(), patches.mark.end());
  for (const auto& t : patches.triangles) all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  return all;
}

}  // namespace

class ComposedMeter::Ground {
 public:
  Ground(const proto::Lattice& lattice, const proto::TileAddress& tile, const TileMesh& mesh, double max_error_m,
         const Loose& loose, const gpu::EcefSteps& ecef_steps)
      : earth_(lattice, tile),
        welded_(with_patches(mesh, loose.patches)),
        error_m_(mesh.triangles.size(), max_error_m),
        least_m_(kRoundingSteps * ecef_steps.coarsest_m + max_error_m),
        rounding_m_(kRoundingSteps * ecef_steps.coarsest_m),
        index_(welded_, proto::is_published),
        loose_(lattice, tile, mesh.side, ecef_steps, loose.samples),
        at_(welded_.vertices()),
        on_rim_(welded_.vertices(), 0) {
    std::fill(on_rim_.begin() + static_cast<std::ptrdiff_t>(mesh.vertices()), on_rim_.end(), 1);
    for (const auto& t : mesh.triangles)
      if (!is_published(mesh, t))
        for (const std::uint32_t v : t) on_rim_[v] = 1;
    for (std::uint32_t v = 0; v < mesh.vertices(); ++v)
      if (mesh.mark[v] & kOverVoid) on_rim_[v] = 1;
    has_rims_ = std::find(on_rim_.begin(), on_rim_.end(), 1) != on_rim_.end();
    error_m_.insert(error_m_.end(), loose.patch_error_m.begin(), loose.patch_error_m.end());
    for (std::uint32_t v = 0; v < at_.size(); ++v) at_[v] = earth_.at(point(v));
    for (const auto& t : welded_.triangles) planes_.push_back(plane_of(at_[t[0]], at_[t[1]], at_[t[2]]));
  }

  double least_m() const { return least_m_; }
  std::size_t points() const { return welded_.vertices() + loose_.size(); }

  double error_m(const std::array<gpu::MeshPoint, 3>& corners, double enough_m) const {
    std::vector<std::uint32_t> near;
    const Seen seen = see(corners, enough_m, near);
    if (seen.shown_already || seen.error_m > enough_m || !has_area(seen.plane)) return seen.error_m;
    return std::max(seen.error_m, loose_.farthest(corners).error_m);
  }

  gpu::TriangleError measure(const std::array<gpu::MeshPoint, 3>& corners, double limit_m) const {
    gpu::TriangleError error;
    std::vector<std::uint32_t> near;
    const Seen seen = see(corners, INFINITY, near);
    error.error_m = seen.error_m;
    if (seen.shown_already || !has_area(seen.plane)) return error;
    const LooseSamples::Farthest loose = loose_.farthest(corners);
    error.error_m = std::max(seen.error_m, loose.error_m);
    if (error.error_m <= limit_m) return error;
    if (loose.inside_m > limit_m || (seen.error_m <= limit_m && loose.inside_m >= 0)) error.offer(loose.inside);
    offer_farthest(corners, seen.plane, near, error);
    if (seen.over == kNone) return error;
    if (error.count == 0) offer_nearest(corners, seen.worst, welded_.triangles[seen.over], error);
    offer_between(seen.worst, welded_.triangles[seen.over], error);
    return error;
  }

 private:
  // What the welded triangles tell of another triangle.
  struct Seen {
    FlatTriangle plane;          // of the triangle asked for
    bool shown_already = false;  // it is one of the welded: all samples there are measured against it
    double error_m = 0;
    PlanPoint worst;
    std::uint32_t over = kNone;  // the welded triangle with the worst place
  };

  // near: the welded triangles around. Ends when the error exceeds enough_m.
  Seen see(const std::array<gpu::MeshPoint, 3>& corners, double enough_m, std::vector<std::uint32_t>& near) const {
    Seen seen;
    seen.plane = plane_of(earth_.at(corners[0]), earth_.at(corners[1]), earth_.at(corners[2]));
    if (!has_area(seen.plane)) return seen;
    std::array<PlanPoint, 3> plan;
    for (std::size_t k = 0; k < 3; ++k) plan[k] = {static_cast<double>(corners[k].x), static_cast<double>(corners[k].y)};
    index_.meeting(plan, near);
    const auto same =
        std::find_if(near.begin(), near.end(), [&](std::uint32_t k) { return is_same(welded_.triangles[k], corners); });
    if (same != near.end()) {
      seen.shown_already = true;
      seen.error_m = rounding_m_ + error_m_[*same];
      return seen;
    }
    for (const std::uint32_t k : near) {
      const Common common = common_part(plan, plan_of(welded_, welded_.triangles[k]));
      if (common.count <= 2 || !has_area(planes_[k])) continue;
      const Apart here = apart(planes_[k], seen.plane, common, earth_);
      const double error_m = rounding_m_ + (error_m_[k] + here.most_m);
      if (error_m <= seen.error_m) continue;
      seen.error_m = error_m;
      seen.worst = here.at;
      seen.over = k;
      if (error_m > enough_m) break;
    }
    return seen;
  }

  gpu::MeshPoint point(std::uint32_t v) const { return {welded_.x[v], welded_.y[v], welded_.height[v]}; }

  bool is_same(const std::array<std::uint32_t, 3>& t, const std::array<gpu::MeshPoint, 3>& corners) const {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) {
      const gpu::MeshPoint p = point(v);
      return std::any_of(corners.begin(), corners.end(),
                         [&](const gpu::MeshPoint& c) { return same_place(c, p) && c.height == p.height; });
    });
  }

  bool on_border(const gpu::MeshPoint& p) const { return p.x == 0 || p.y == 0 || p.x == welded_.side || p.y == welded_.side; }
  bool could_be_corner(const std::array<gpu::MeshPoint, 3>& c, const gpu::MeshPoint& p) const {
    if (on_border(p)) return false;
    if (same_place(p, c[0]) || same_place(p, c[1]) || same_place(p, c[2])) return false;
    return twice_area(c[0], c[1], p) >= 0 && twice_area(c[1], c[2], p) >= 0 && twice_area(c[2], c[0], p) >= 0;
  }

  // Where edges cross and no vertex lies between: the ends of the children's edges there, the nearest first.
  void offer_nearest(const std::array<gpu::MeshPoint, 3>& c, PlanPoint at, const std::array<std::uint32_t, 3>& triangle,
                     gpu::TriangleError& error) const {
    std::array<std::pair<double, std::uint32_t>, 3> ends;
    for (std::size_t k = 0; k < 3; ++k) {
      const double dx = welded_.x[triangle[k]] - at.x, dy = welded_.y[triangle[k]] - at.y;
      ends[k] = {dx * dx + dy * dy, triangle[k]};
    }
    std::sort(ends.begin(), ends.end());
    for (const auto& [distance, v] : ends) {
      const gpu::MeshPoint p = point(v);
      if (!on_border(p) && !same_place(p, c[0]) && !same_place(p, c[1]) && !same_place(p, c[2])) error.offer(p);
    }
  }

  bool along_rim(const std::array<std::uint32_t, 3>& t) const {
    return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return on_rim_[v] != 0; });
  }
  // Rounded, a place of a needle may be in another triangle.
  bool is_off_rims(const gpu::MeshPoint& p) const {
    if (!has_rims_) return true;
    const PlanPoint at{static_cast<double>(p.x), static_cast<double>(p.y)};
    std::vector<std::uint32_t> near;
    index_.meeting({at, at, at}, near);
    return std::any_of(near.begin(), near.end(), [&](std::uint32_t k) {
      const auto& t = welded_.triangles[k];
      return !along_rim(t) && twice_area(point(t[0]), point(t[1]), p) >= 0 && twice_area(point(t[1]), point(t[2]), p) >= 0 &&
             twice_area(point(t[2]), point(t[0]), p) >= 0;
    });
  }

  // The place itself, where all ends are vertices already and still other edges run between them. Not along a rim, nor where one
  // has moved over places without data, here or on a finer level: no vertex stands on those.
  void offer_between(PlanPoint at, const std::array<std::uint32_t, 3>& triangle, gpu::TriangleError& error) const {
    gpu::MeshPoint p{static_cast<std::int32_t>(std::lround(at.x)), static_cast<std::int32_t>(std::lround(at.y)), 0};
    const gpu::MeshPoint c[3] = {point(triangle[0]), point(triangle[1]), point(triangle[2])};
    if (along_rim(triangle) || on_border(p) || !is_off_rims(p)) return;
    double height = 0, sum = 0;
    for (int k = 0; k < 3; ++k) {  // rounded, the place may be a little outside
      const double weight = std::max(0.0, static_cast<double>(twice_area(c[(k + 1) % 3], c[(k + 2) % 3], p)));
      height += weight * c[k].height;
      sum += weight;
    }
    if (sum <= 0) return;
    p.height = static_cast<std::int32_t>(std::lround(height / sum));
    error.offer(p);
  }

  void offer_farthest(const std::array<gpu::MeshPoint, 3>& c, const FlatTriangle& plane, const std::vector<std::uint32_t>& near,
                      gpu::TriangleError& error) const {
    double farthest_m = -1;
    gpu::MeshPoint farthest;
    for (const std::uint32_t k : near) {
      for (const std::uint32_t v : welded_.triangles[k]) {
        const gpu::MeshPoint p = point(v);
        if (!could_be_corner(c, p)) continue;
        const Over here = over(plane, earth_.place({static_cast<double>(p.x), static_cast<double>(p.y)}));
        const double height_m = p.height * proto::kHeightStep_m;
        const double apart = std::max(std::abs(here.low_m - height_m), std::abs(here.high_m - height_m));
        if (apart <= farthest_m) continue;
        farthest_m = apart;
        farthest = p;
      }
    }
    if (farthest_m >= 0) error.offer(farthest);
  }

  Earth earth_;
  TileMesh welded_;
  std::vector<double> error_m_;  // indexed by welded triangle
  double least_m_, rounding_m_;
  TriangleIndex index_;
  LooseSamples loose_;
  std::vector<Spot> at_;              // indexed by welded vertex
  std::vector<char> on_rim_;          // likewise: beside an unpublished triangle, of a patch, or kOverVoid
  bool has_rims_ = false;             // any of them
  std::vector<FlatTriangle> planes_;  // indexed by welded triangle
};

ComposedMeter::ComposedMeter(const proto::Lattice& lattice, const proto::TileAddress& tile, const TileMesh& mesh,
                             double max_error_m, const Loose& loose, const gpu::EcefSteps& ecef_steps)
    : ground_(std::make_unique<Ground>(lattice, tile, mesh, max_error_m, loose, ecef_steps)) {}
ComposedMeter::~ComposedMeter() = default;

gpu::TriangleError ComposedMeter::measure(const std::array<gpu::MeshPoint, 3>& corners, double limit_m) const {
  return ground_->measure(corners, limit_m);
}

double ComposedMeter::error_m(const std::array<gpu::MeshPoint, 3>& corners, const gpu::Glance& asked) const {
  return ground_->error_m(corners, asked.enough_m);
}

double ComposedMeter::least_m() const { return ground_->least_m(); }
std::size_t ComposedMeter::points() const { return ground_->points(); }

gpu::TriangleError NearerMeter::measure(const std::array<gpu::MeshPoint, 3>& corners, double limit_m) const {
  gpu::TriangleError first = first_.measure(corners, limit_m);
  if (first.error_m <= limit_m) return first;
  first.error_m = std::min(first.error_m, second_.measure(corners, INFINITY).error_m);
  if (first.error_m <= limit_m) first.count = 0;
  return first;
}

double NearerMeter::error_m(const std::array<gpu::MeshPoint, 3>& corners, const gpu::Glance& asked) const {
  const double first_m = first_.error_m(corners, asked);
  return first_m <= asked.enough_m ? first_m : std::min(first_m, second_.error_m(corners, asked));
}

double greatest_error_m(const gpu::ErrorMeter& meter, const TileMesh& mesh, double limit_m, std::vector<std::uint32_t>& over) {
  double greatest = 0;
  for (std::uint32_t k = 0; k < mesh.triangles.size(); ++k) {
    const auto& t = mesh.triangles[k];
    if (!is_published(mesh, t)) continue;
    const std::array<gpu::MeshPoint, 3> corners = corners_of(mesh, t);
    const double error_m = meter.measure(corners, limit_m).error_m;
    greatest = std::max(greatest, error_m);
    if (error_m > limit_m) over.push_back(k);
  }
  return greatest;
}

}  // namespace cordillera::pipeline
