/* Cordillera's simplifier for programs in C, and for all that can call C. cordillera/simplify.hpp is the same for C++.

   A height field goes in: a triangulated surface of which no two points lie above each other. Out comes one with fewer triangles,
   as accurate as their count allows. The same input and options give the same bytes on every machine, with and without a GPU.

   What stands here stays: functions and fields may be added, none changes its meaning. */
#ifndef CORDILLERA_SIMPLIFY_H
#define CORDILLERA_SIMPLIFY_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* x and y are the plan, z is up; z may have another unit than x and y. Triangles are three indices each, all counter-clockwise or
   all clockwise seen from above. Borders and holes may have any shape; the border stays where it is. */
typedef struct cordillera_mesh {
  const double* x;
  const double* y;
  const double* z;
  size_t vertices; /* length of x, y and z */
  const uint32_t* triangles;
  size_t triangle_count; /* a third of the length of triangles */
} cordillera_mesh;

enum cordillera_target {
  CORDILLERA_KEEP,      /* the share of the triangles that stays, above 0 and at most 1 */
  CORDILLERA_TRIANGLES, /* how many triangles stay */
  CORDILLERA_ERROR      /* as few as lie within this distance along z of every vertex of the input */
};

enum cordillera_quality {
  CORDILLERA_DEFAULT,
  CORDILLERA_FAST,
  CORDILLERA_BEST,   /* least RMSE */
  CORDILLERA_MINIMAX /* least greatest error */
};

/* Zero where it says nothing else, so that fields that are added later have their defaults:
   cordillera_options o = {sizeof o}; */
typedef struct cordillera_options {
  size_t size;        /* sizeof(cordillera_options), as the program was compiled */
  int target;         /* enum cordillera_target */
  int quality;        /* enum cordillera_quality */
  double value;       /* of the target */
  const char* device; /* "auto", "cpu", "cuda" or "cuda:N"; NULL: auto */
  unsigned threads;   /* of a CPU; 0: one for each usable core. The result does not depend on them */
} cordillera_options;

typedef struct cordillera_result cordillera_result;

/* Never NULL unless there is no memory. To be freed. May be called from several threads at once. */
cordillera_result* cordillera_simplify(const cordillera_mesh* mesh, const cordillera_options* options);
void cordillera_result_free(cordillera_result* result);

/* NULL if all went well, else what is wrong, where, and what would be accepted. Then the rest says nothing. */
const char* cordillera_result_problem(const cordillera_result* result);
/* Its stable word, such as "mesh-not-finite"; NULL if all went well. */
const char* cordillera_result_problem_type(const cordillera_result* result);

/* Counter-clockwise seen from above. Valid until the result is freed. */
cordillera_mesh cordillera_result_mesh(const cordillera_result* result);
/* Along z, over all vertices of the input, against the new surface. */
double cordillera_result_rmse(const cordillera_result* result);
double cordillera_result_max_error(const cordillera_result* result);
double cordillera_result_seconds(const cordillera_result* result);
const char* cordillera_result_device(const cordillera_result* result);

const char* cordillera_version(void);

#ifdef __cplusplus
}
#endif
#endif
