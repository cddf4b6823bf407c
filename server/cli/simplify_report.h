#pragma once
// What cordillera simplify tells of its work.
#include <optional>
#include <string>

#include "gpu/cleap/cleap.h"
#include "gpu/fit/simplify_height_mesh.h"
#include "gpu/fit/vertical_error.h"
#include "proto/mesh_file/mesh_file.h"

namespace cordillera::server {

struct SimplifyReport {
  std::string input, output;
  proto::MeshEncoding source, written;
  std::uint64_t input_vertices = 0, input_triangles = 0;
  std::uint64_t joined_vertices = 0;  ///< of the input, that stand where another one does and became one with it
  std::string strategy = "waves";
  gpu::fit::MeshReport simplified;
  std::optional<gpu::cleap::Report> cleap;  ///< of the published algorithm
  gpu::VerticalError error;  ///< of the written surface, at the vertices of the input; measured apart from the simplifier
  std::uint64_t turned_triangles = 0;  ///< of the result, seen from above: --smooth may fold it
  double read_seconds = 0, write_seconds = 0;
  double cpu_seconds =
      0;  ///< of all threads while simplifying, checks of the input included; says more than the clock on a busy machine
};

/// One object, with a line's end.
std::string report_json(const SimplifyReport& report);
/// Lines for a person.
std::string report_table(const SimplifyReport& report);

}  // namespace cordillera::server
