/* A hill of 101 x 101 vertices keeps a tenth of its triangles. */
#include <cordillera/simplify.h>
#include <math.h>
#include <stdio.h>

enum { SIDE = 101 };
static double x[SIDE * SIDE], y[SIDE * SIDE], z[SIDE * SIDE];
static uint32_t triangles[2 * (SIDE - 1) * (SIDE - 1)][3];

static size_t make_hill(void) {
  size_t count = 0;
  for (uint32_t k = 0; k < SIDE * SIDE; ++k) {
    const double east = k % SIDE - 50.0, north = k / SIDE - 50.0;
    x[k] = 30 * east, y[k] = 30 * north, z[k] = 400 * exp(-(east * east / 625 + north * north / 400));
    if (k % SIDE == SIDE - 1 || k / SIDE == SIDE - 1) continue;
    const uint32_t lower[3] = {k, k + 1, k + SIDE + 1}, upper[3] = {k, k + SIDE + 1, k + SIDE};
    for (int c = 0; c < 3; ++c) triangles[count][c] = lower[c], triangles[count + 1][c] = upper[c];
    count += 2;
  }
  return count;
}

int main(void) {
  const cordillera_mesh hill = {x, y, z, SIDE * SIDE, triangles[0], make_hill()};
  cordillera_options options = {sizeof options};
  options.target = CORDILLERA_KEEP;
  options.value = 0.1;
  options.device = "cpu";
  cordillera_result* result = cordillera_simplify(&hill, &options);
  if (!result) return 1;
  if (cordillera_result_problem(result)) {
    fprintf(stderr, "%s\n", cordillera_result_problem(result));
    return 1;
  }
  const cordillera_mesh few = cordillera_result_mesh(result);
  printf("%zu of %zu triangles, RMSE %.3f m, greatest error %.3f m\n", few.triangle_count, hill.triangle_count,
         cordillera_result_rmse(result), cordillera_result_max_error(result));
  cordillera_result_free(result);

  z[7] = NAN; /* what is no height is refused, with its place */
  result = cordillera_simplify(&hill, &options);
  printf("%s: %s\n", cordillera_result_problem_type(result), cordillera_result_problem(result));
  cordillera_result_free(result);
  return 0;
}
