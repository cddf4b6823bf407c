// Cordillera's simplifier for C++17 and later: cordillera/simplify.h with vectors and exceptions. Nothing of it is compiled into
// the library, so any compiler and standard library will do.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "simplify.h"

namespace cordillera {

/// A height field: x and y are the plan, z is up. The three have one length; triangles index them.
struct Mesh {
  std::vector<double> x, y, z;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

enum class Quality {
  default_ = CORDILLERA_DEFAULT,
  fast = CORDILLERA_FAST,
  best = CORDILLERA_BEST,
  minimax = CORDILLERA_MINIMAX
};

struct Target {
  static Target keep(double share) { return {CORDILLERA_KEEP, share}; }
  static Target triangles(std::uint64_t count) { return {CORDILLERA_TRIANGLES, static_cast<double>(count)}; }
  static Target error(double along_z) { return {CORDILLERA_ERROR, along_z}; }
  cordillera_target kind;
  double value;
};

struct Options {
  Quality quality = Quality::default_;
  std::string device = "auto";  ///< "auto", "cpu", "cuda" or "cuda:N"
  unsigned threads = 0;         ///< of a CPU; 0: one for each usable core
};

struct Simplified {
  Mesh mesh;
  double rmse = 0, max_error = 0;  ///< along z, over all vertices of the input
  double seconds = 0;
  std::string device;  ///< that did it
};

/// Input that is no height field, or a target or device that there is not.
class SimplifyError : public std::runtime_error {
 public:
  SimplifyError(std::string type, const char* words) : std::runtime_error(words), type_(std::move(type)) {}
  const std::string& type() const { return type_; }  ///< a stable word, such as "mesh-not-finite"

 private:
  std::string type_;
};

inline Simplified simplify(const Mesh& mesh, const Target& target, const Options& options = {}) {
  if (mesh.y.size() != mesh.x.size() || mesh.z.size() != mesh.x.size())
    throw SimplifyError("mesh-broken", "x, y and z must have one length");
  const cordillera_mesh given = {mesh.x.data(),
                                 mesh.y.data(),
                                 mesh.z.data(),
                                 mesh.x.size(),
                                 mesh.triangles.empty() ? nullptr : mesh.triangles.data()->data(),
                                 mesh.triangles.size()};
  cordillera_options words = {};
  words.size = sizeof words;
  words.target = target.kind;
  words.value = target.value;
  words.quality = static_cast<int>(options.quality);
  words.device = options.device.c_str();
  words.threads = options.threads;
  const std::unique_ptr<cordillera_result, void (*)(cordillera_result*)> result(cordillera_simplify(&given, &words),
                                                                                cordillera_result_free);
  if (!result) throw std::bad_alloc();
  if (const char* problem = cordillera_result_problem(result.get()))
    throw SimplifyError(cordillera_result_problem_type(result.get()), problem);
  const cordillera_mesh out = cordillera_result_mesh(result.get());
  Simplified simplified;
  simplified.mesh.x.assign(out.x, out.x + out.vertices);
  simplified.mesh.y.assign(out.y, out.y + out.vertices);
  simplified.mesh.z.assign(out.z, out.z + out.vertices);
  simplified.mesh.triangles.resize(out.triangle_count);
  for (std::size_t t = 0; t < out.triangle_count; ++t)
    simplified.mesh.triangles[t] = {out.triangles[3 * t], out.triangles[3 * t + 1], out.triangles[3 * t + 2]};
  simplified.rmse = cordillera_result_rmse(result.get());
  simplified.max_error = cordillera_result_max_error(result.get());
  simplified.seconds = cordillera_result_seconds(result.get());
  simplified.device = cordillera_result_device(result.get());
  return simplified;
}

}  // namespace cordillera
