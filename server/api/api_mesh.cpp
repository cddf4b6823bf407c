// A part of a dataset as one mesh, made while the client waits.
#include <atomic>
#include <sstream>

#include "pipeline/exports/mesh/mesh_output.h"
#include "pipeline/store/content_hash.h"
#include "server/api/api.h"
#include "server/http/byte_range.h"
#include "server/options/mesh_options.h"

namespace cordillera::server {
namespace {

using namespace pipeline::exports;

// Each may hold some 300 MB for a few seconds.
constexpr int kMostAtOnce = 4;
std::atomic<int> g_under_way{0};

/// One of the few that may work at the same time.
class Turn {
 public:
  Turn() : mine_(g_under_way.fetch_add(1) < kMostAtOnce) {}
  ~Turn() { g_under_way.fetch_sub(1); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  bool mine() const { return mine_; }

 private:
  bool mine_;
};

std::string file_name(const Dataset& dataset, const ExtractedMesh& mesh, const std::string& ending) {
  return dataset.id + "-" + std::to_string(mesh.level) + "." + ending;  // an id has letters, digits and dashes only
}

}  // namespace

Response extracted_mesh(Service& service, const Request& request, const Dataset& dataset, const Route& route) {
  const std::string ending = route.path.substr(route.path.find('.') + 1);
  const MeshKind kind = *mesh_kind(ending);
  auto wanted = mesh_request(request.query, Spelling::query);
  if (!wanted) return problem_response(wanted.problem());
  wanted->most_triangles = kMostTrianglesOverHttp;
  if (const auto held = check_frame(kind, wanted->frame); !held) return problem_response(held.problem());
  const Opened opened = open_published(service, dataset, route);
  if (!opened.terrain) return opened.refusal;
  const Turn turn;
  if (!turn.mine()) {
    return problem_response({"service-busy", "too many meshes are being made", "asking again in a few seconds", ""});
  }

  const auto mesh = extract_mesh(*opened.terrain, *wanted);
  if (!mesh) return problem_response(mesh.problem());
  std::ostringstream bytes;
  write_mesh(bytes, *mesh, kind, opened.terrain->manifest());
  Response response;
  response.body = std::move(bytes).str();
  response.set("Content-Type", std::string(media_type(kind)));
  response.set("Content-Disposition", "inline; filename=\"" + file_name(dataset, *mesh, ending) + "\"");
  response.set("Cache-Control", cache_control(route));
  response.set("ETag", quoted(pipeline::hex(pipeline::content_hash(response.body))));
  return cut_to_range(request, if_changed(request, std::move(response)));
}

}  // namespace cordillera::server
