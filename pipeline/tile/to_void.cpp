#include "pipeline/tile/to_void.h"

#include "proto/integers.h"

namespace cordillera::pipeline {
namespace {

constexpr std::int64_t kOutside = -1;

/// Where rows and columns of the lattice are in a window.
class InWindow {
 public:
  InWindow(const proto::Samples& samples, const proto::Lattice& lattice) : samples_(samples), circle_(lattice.columns()) {}
  std::int64_t column(std::int64_t i) const {
    const std::int64_t c = proto::modulo(i - samples_.west, circle_);
    return c < samples_.columns ? c : kOutside;
  }
  std::int64_t row(std::int64_t j) const {
    return j >= samples_.south && j < samples_.south + samples_.rows ? j - samples_.south : kOutside;
  }
  bool has_data(std::int64_t column, std::int64_t row) const {
    if (column == kOutside || row == kOutside) return false;
    return samples_.height[static_cast<std::size_t>(row * samples_.columns + column)] != proto::kNoHeight;
  }

 private:
  const proto::Samples& samples_;
  std::int64_t circle_;
};

}  // namespace

std::vector<std::int32_t> distances_to_void(const proto::Samples& samples, const Edge& edge, std::int64_t first,
                                            std::int64_t count, std::int64_t reach) {
  const InWindow window(samples, *edge.lattice);
  const bool east = edge.along == Along::east;
  std::vector<std::int64_t> along;
  for (std::int64_t k = first; k < first + count; ++k)
    along.push_back(east ? window.column(edge.column + k) : window.row(edge.row + k));
  std::vector<std::int32_t> distance(along.size(), static_cast<std::int32_t>(reach + 1));
  std::size_t open = along.size();
  for (std::int64_t d = 0; d <= reach && open > 0; ++d) {
    for (const std::int64_t offset : {-d, d}) {
      const std::int64_t line = (east ? edge.row : edge.column) + offset;
      if (east && (line < 0 || line > edge.lattice->rows())) continue;
      const std::int64_t across = east ? window.row(line) : window.column(line);
      for (std::size_t k = 0; k < along.size(); ++k) {
        if (distance[k] <= reach || (east ? window.has_data(along[k], across) : window.has_data(across, along[k]))) continue;
        distance[k] = static_cast<std::int32_t>(d);
        --open;
      }
    }
  }
  return distance;
}

}  // namespace cordillera::pipeline
