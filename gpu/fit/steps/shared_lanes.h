#pragma once
// Several lanes on one vertex: each takes rows of samples, whatever triangle they belong to, and the sums of rows go in their
// order to the lane that keeps the triangle's. An Exchange has
//   kCount          lanes, a power of two
//   index()         of this one
//   from(value, k)  what lane k gives as value; all lanes call it together
//   part(), parts() which group of so many lanes this one is in, of how many that are on the same vertex
//   from_part(value, k)  what the same lane of part k gives; all lanes of all parts call it together
#include "gpu/fit/steps/samples.h"

namespace cordillera::gpu::fit {

template <class Exchange>
class SharedLanes {
 public:
  CORDILLERA_HD explicit SharedLanes(const Exchange& exchange) : exchange_(exchange) {}
  CORDILLERA_HD bool leads() const { return exchange_.index() == 0 && exchange_.part() == 0; }
  CORDILLERA_HD std::uint32_t part() const { return exchange_.part(); }
  CORDILLERA_HD std::uint32_t parts() const { return Exchange::kParts; }
  template <class T, class Take>
  CORDILLERA_HD void each_part(const T& value, const Take& take) const {
    const T mine = value;
    for (std::uint32_t k = 0; k < Exchange::kParts; ++k) take(exchange_.from_part(mine, k));
  }

  /// See OneLane.
  template <class Sum, class Samples, class Work, class Take>
  CORDILLERA_HD void sum(const Samples& samples, std::uint32_t n, const Work& work, const Take& take) const {
    for (std::uint32_t first = 0; first < n; first += kCount) {
      const std::uint32_t some = n - first < kCount ? n - first : kCount;
      const Share share = share_of(samples, first, some, work);
      Sum whole;
      for (std::uint32_t begin = 0; begin < share.rows; begin += kCount) {
        const Place place = place_of(share, begin + exchange_.index());
        Sum part;
        if (begin + exchange_.index() < share.rows) {
          const auto triangle = work(first + place.triangle);
          samples.in_row(triangle.a, triangle.b, triangle.c, place.row,
                         [&](std::uint32_t sample, auto e0, auto e1, auto e2) { triangle.add(part, sample, e0, e1, e2); });
        }
        collect(share, begin, part, whole);
      }
      for (std::uint32_t i = 0; i < some; ++i) take(first + i, exchange_.from(whole, i));
    }
  }

  template <class Samples, class Work>
  CORDILLERA_HD void each(const Samples& samples, std::uint32_t n, const Work& work) const {
    for (std::uint32_t first = 0; first < n; first += kCount) {
      const Share share = share_of(samples, first, n - first < kCount ? n - first : kCount, work);
      for (std::uint32_t begin = 0; begin < share.rows; begin += kCount) {
        const Place place = place_of(share, begin + exchange_.index());
        if (begin + exchange_.index() >= share.rows) continue;
        const auto triangle = work(first + place.triangle);
        samples.in_row(triangle.a, triangle.b, triangle.c, place.row,
                       [&](std::uint32_t sample, auto e0, auto e1, auto e2) { triangle.visit(sample, e0, e1, e2); });
      }
    }
  }

 private:
  static constexpr std::uint32_t kCount = Exchange::kCount;

  /// The rows of as many triangles as there are lanes, one after the other: of this lane's triangle, and of all.
  struct Share {
    std::int32_t first_row;
    std::uint32_t begin, end, rows;
  };
  struct Place {
    std::uint32_t triangle;
    std::int32_t row;
  };

  template <class Samples, class Work>
  CORDILLERA_HD Share share_of(const Samples& samples, std::uint32_t first, std::uint32_t some, const Work& work) const {
    Share share{0, 0, 0, 0};
    std::uint32_t own = 0;
    if (exchange_.index() < some) {
      const auto triangle = work(first + exchange_.index());
      const Rows rows = samples.rows_of(triangle.a, triangle.b, triangle.c);
      share.first_row = rows.begin;
      own = rows.end > rows.begin ? static_cast<std::uint32_t>(rows.end - rows.begin) : 0;
    }
    share.end = own;
    for (std::uint32_t off = 1; off < kCount; off *= 2) {
      const std::uint32_t before = exchange_.from(share.end, exchange_.index() - off & (kCount - 1));
      if (exchange_.index() >= off) share.end += before;
    }
    share.begin = share.end - own;
    share.rows = exchange_.from(share.end, kCount - 1);
    return share;
  }

  /// Of the i-th row of all. Beyond the last row: anything.
  CORDILLERA_HD Place place_of(const Share& share, std::uint32_t i) const {
    std::uint32_t triangle = 0;  // the first whose rows do not end before i
    for (std::uint32_t step = kCount / 2; step > 0; step /= 2) {
      if (exchange_.from(share.end, triangle + step - 1) <= i) triangle += step;
    }
    const std::uint32_t begin = exchange_.from(share.begin, triangle);
    return {triangle, exchange_.from(share.first_row, triangle) + static_cast<std::int32_t>(i - begin)};
  }

  /// Adds to this lane's triangle what other lanes found in its rows from `begin` on.
  template <class Sum>
  CORDILLERA_HD void collect(const Share& share, std::uint32_t begin, const Sum& part, Sum& whole) const {
    const std::uint32_t from = share.begin > begin ? share.begin : begin;
    const std::uint32_t to = share.end < begin + kCount ? share.end : begin + kCount;
    std::uint32_t most = to > from ? to - from : 0;
    for (std::uint32_t off = 1; off < kCount; off *= 2) {
      const std::uint32_t other = exchange_.from(most, exchange_.index() ^ off);
      most = other > most ? other : most;
    }
    for (std::uint32_t k = 0; k < most; ++k) {
      const Sum other = exchange_.from(part, from + k - begin & (kCount - 1));
      if (from + k < to) whole.add(other);
    }
  }

  Exchange exchange_;
};

}  // namespace cordillera::gpu::fit
