#pragma once
// A vertex is the work of one thread, or of several lanes: all of them run the same function and share only the rows of samples
// in its triangles. Sums run from sample to sample within a row, then row by row: the number of lanes does not show. Where a
// vertex has several edges to look at, lanes may come in parts, each with edges of its own.
#include "gpu/fit/steps/samples.h"

namespace cordillera::gpu::fit {

/// A host's; and a GPU's where there are vertices enough for all threads.
struct OneLane {
  CORDILLERA_HD bool leads() const { return true; }
  CORDILLERA_HD std::uint32_t part() const { return 0; }
  CORDILLERA_HD std::uint32_t parts() const { return 1; }
  /// take(what another part has as value)
  template <class T, class Take>
  CORDILLERA_HD void each_part(const T&, const Take&) const {}

  /// Sums over the samples of triangles 0..n-1, handed out in their order as take(i, sum). work(i) has the corners a, b and c of
  /// triangle i, and adds a sample by add(sum, sample, e0, e1, e2).
  template <class Sum, class Samples, class Work, class Take>
  CORDILLERA_HD void sum(const Samples& samples, std::uint32_t n, const Work& work, const Take& take) const {
    for (std::uint32_t i = 0; i < n; ++i) {
      const auto triangle = work(i);
      Sum whole;
      samples.each_row(triangle.a, triangle.b, triangle.c, [&](const auto& row) {
        Sum part;
        row([&](std::uint32_t sample, auto e0, auto e1, auto e2) { triangle.add(part, sample, e0, e1, e2); });
        whole.add(part);
      });
      take(i, whole);
    }
  }
  /// work(i).visit(sample, e0, e1, e2) for the samples of triangles 0..n-1, in any order.
  template <class Samples, class Work>
  CORDILLERA_HD void each(const Samples& samples, std::uint32_t n, const Work& work) const {
    for (std::uint32_t i = 0; i < n; ++i) {
      const auto triangle = work(i);
      samples.in_triangle(triangle.a, triangle.b, triangle.c,
                          [&](std::uint32_t sample, auto e0, auto e1, auto e2) { triangle.visit(sample, e0, e1, e2); });
    }
  }
};

}  // namespace cordillera::gpu::fit
