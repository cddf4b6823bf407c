// The same hill as hill.c, in C++.
#include <cmath>
#include <cordillera/simplify.hpp>
#include <cstdio>
#include <limits>

int main() {
  cordillera::Mesh hill;
  const std::uint32_t side = 101;
  for (std::uint32_t k = 0; k < side * side; ++k) {
    const double east = k % side - 50.0, north = k / side - 50.0;
    hill.x.push_back(30 * east);
    hill.y.push_back(30 * north);
    hill.z.push_back(400 * std::exp(-(east * east / 625 + north * north / 400)));
    if (k % side == side - 1 || k / side == side - 1) continue;
    hill.triangles.push_back({k, k + 1, k + side + 1});
    hill.triangles.push_back({k, k + side + 1, k + side});
  }
  cordillera::Options options;
  options.device = "cpu";
  const cordillera::Simplified few = cordillera::simplify(hill, cordillera::Target::keep(0.1), options);
  std::printf("%zu of %zu triangles, RMSE %.3f m, greatest error %.3f m\n", few.mesh.triangles.size(), hill.triangles.size(),
              few.rmse, few.max_error);

  hill.z[7] = std::numeric_limits<double>::quiet_NaN();
  try {
    cordillera::simplify(hill, cordillera::Target::keep(0.1), options);
  } catch (const cordillera::SimplifyError& error) { std::printf("%s: %s\n", error.type().c_str(), error.what()); }
}
