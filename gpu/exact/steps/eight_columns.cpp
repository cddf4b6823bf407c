#include "gpu/exact/steps/eight_columns.h"

#include "gpu/exact/steps/coded.h"
#include "gpu/exact/steps/lanes.h"

namespace cordillera::gpu::exact {
namespace {

/// Eight columns of a row, `stride` samples apart; those beyond `count` are the last one's.
CORDILLERA_LANES void load_columns(Floats& to, const float* sample, int stride, int count) {
  if (stride == 1) return load(to, sample);
  float columns[kLanes];
  for (int k = 0; k < kLanes; ++k) columns[k] = sample[stride * least(k, count - 1)];
  load(to, columns);
}

/// Below so many units nearest_whole goes the way of this constant.
constexpr float kManyUnits = 0x1p22f, kNoFraction = 0x1.8p23f;

}  // namespace

CORDILLERA_WIDE bool eight_columns_fit(const Triangle& t, const Field& field, int west, int south, int north) {
  const Ints lane = {0, 1, 2, 3, 4, 5, 6, 7};
  Ints edge[3];
  for (int k = 0; k < 3; ++k) edge[k] = t.across[k] * lane + t.edge(k, west, south);
  const Ints column = lane + (west - t.ex[0]);
  const Floats u = __builtin_convertvector(column, Floats);
  const Floats along = t.dx * u + t.bend_x * (u * u);
  const float* sample = field.height + field.index(west, south);
  Ints bad = {};
  for (int y = south; y <= north; ++y, sample += field.stride) {
    Floats height;
    load(height, sample);
    const Floats off = (t.height - height) + (along + t.rise_up(static_cast<float>(y - t.ey[0])));
    bad |= ~((off <= t.tolerance) & (off >= -t.tolerance)) & ((edge[0] | edge[1] | edge[2]) >= 0);
    for (int k = 0; k < 3; ++k) edge[k] += t.along[k];
  }
  return !any(bad);
}

namespace {

/// The rows of a square of coded samples that a triangle's box touches, one after the other.
class CodedRows {
 public:
  CORDILLERA_LANES CodedRows(const Triangle& t, const Field& field, int sx, int sy)
      : t_(t), y_(greatest(8 * sy, t.south)), north_(least(8 * sy + 7, t.north)) {
    const auto square = static_cast<std::size_t>(sy * field.tier_stride[0] + sx);
    plane_ = field.plane[0][square];
    code_ = field.code + 64 * square + Field::code_place(0, y_);
    const Ints lane = {0, 1, 2, 3, 4, 5, 6, 7};
    for (int k = 0; k < 3; ++k) edge_[k] = t.across[k] * lane + t.edge(k, 8 * sx, y_);
    const Floats u = __builtin_convertvector(lane + (8 * sx - t.ex[0]), Floats);
    along_ = t.dx * u + t.bend_x * (u * u);
    plane_along_ = plane_.dx * (__builtin_convertvector(lane, Floats) - 3.5f);
  }
  CORDILLERA_LANES bool next() {
    if (y_ > north_) return false;
    using Bytes = std::uint8_t __attribute__((vector_size(8)));
    Bytes bytes;
    load(bytes, code_);
    const Ints code = __builtin_convertvector(bytes, Ints);
    const Floats steps = (__builtin_convertvector(code, Floats) - 128.0f) / 127.0f,
                 plane = plane_.middle + (plane_along_ + plane_.dy * (static_cast<float>(y_ & 7) - 3.5f));
    off = (t_.height - (plane + plane_.off * steps)) + (along_ + t_.rise_up(static_cast<float>(y_ - t_.ey[0])));
    covered = (edge_[0] | edge_[1] | edge_[2]) >= 0;
    valid = code != 0;
    for (int k = 0; k < 3; ++k) edge_[k] += t_.along[k];
    code_ += 8;
    ++y_;
    return true;
  }

  Floats off;           ///< of the triangle above the samples
  Ints covered, valid;  ///< samples lie under it; they are not void

 private:
  const Triangle& t_;
  BoundingPlane plane_;
  const std::uint8_t* code_;
  Ints edge_[3];
  Floats along_, plane_along_;
  int y_, north_;
};

}  // namespace

CORDILLERA_WIDE bool eight_coded_fit(const Triangle& t, const Field& field, int sx, int sy) {
  const float tolerance = less_code_error(t, field, sx, sy).tolerance;
  Ints bad = {};
  for (CodedRows rows(t, field, sx, sy); rows.next();)
    bad |= ~((rows.off <= tolerance) & (rows.off >= -tolerance)) & rows.covered;
  return !any(bad);
}

CORDILLERA_WIDE float eight_coded_error(const Triangle& t, const Field& field, int sx, int sy) {
  const Floats none = Floats{} - 1;
  Floats worst = none;
  for (CodedRows rows(t, field, sx, sy); rows.next();) {
    const Floats off = rows.off < 0 ? -rows.off : rows.off;
    worst = (off > worst) & rows.covered & rows.valid ? off : worst;
  }
  float lane[kLanes], greatest_off = -1;
  store(lane, worst);
  for (const float off : lane) greatest_off = off > greatest_off ? off : greatest_off;
  return greatest_off;
}

CORDILLERA_WIDE Pull eight_columns_pull(const PullBox& box, const Field& field) {
  const Ints lane = {0, 1, 2, 3, 4, 5, 6, 7};
  const Triangle& t = box.t;
  Ints sum = {}, weight = {}, too_many = {};
  const int south = box.south * box.stride;
  for (int first = 0; first < box.columns; first += kLanes) {
    const int west = (box.west + first) * box.stride;
    const Ints right = box.stride * lane;
    Ints edge[3];
    for (int k = 0; k < 3; ++k) edge[k] = t.across[k] * right + t.edge(k, west, south);
    const Floats u = __builtin_convertvector(right + (west - t.ex[0]), Floats);
    const Floats along = t.dx * u + t.bend_x * (u * u);
    for (int row = 0; row < box.rows; ++row) {
      const int y = south + row * box.stride;
      Floats height;
      load_columns(height, field.height + field.index(west, y), box.stride, box.columns - first);
      const Ints here = (edge[0] | edge[1] | edge[2]) >= 0;  // columns beyond the box are not under it
      Floats many = -((t.height - height) + (along + t.rise_up(static_cast<float>(y - t.ey[0])))) * box.per_tolerance;
      keep(many, here);
      too_many |= (many >= kManyUnits) | (many <= -kManyUnits);
      const Ints units = __builtin_convertvector((many + kNoFraction) - kNoFraction, Ints);
      const Ints near = __builtin_convertvector(__builtin_convertvector(edge[1], Floats) * box.per_area + 0.5f, Ints) & here;
      sum += near * units / 16;
      weight += near * near / 16;
      for (int k = 0; k < 3; ++k) edge[k] += t.along[k] * box.stride;
    }
  }
  if (any(too_many)) return box.all(field);
  return {sum_of(sum), sum_of(weight)};
}

}  // namespace cordillera::gpu::exact
