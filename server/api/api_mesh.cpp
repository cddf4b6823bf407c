// A part of a dataset as one mesh, made while the client waits.
#include <algorithm>
#include <atomic>
#include <optional>
#include <sstream>
#include <vector>

#include "pipeline/exports/mesh/mesh_output.h"
#include "pipeline/store/content_hash.h"
#include "proto/integers.h"
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

/// Blocks of a dataset that is being built, in which a mesh of one of their levels lies. A box without a level is of the finest
/// of them that has few enough triangles. None: it is of no such level, or lies in more blocks than one request looks at.
std::optional<std::vector<proto::TileAddress>> blocks_under(const pipeline::faces::Terrain& shown, const MeshRequest& wanted) {
  const proto::Manifest& manifest = shown.manifest();
  const int finest = static_cast<int>(manifest.max_level());
  const auto level = wanted.tile ? std::optional(wanted.tile->z) : wanted.box ? wanted.level.value_or(finest) : wanted.level;
  if (!manifest.has_done_blocks() || !level) return std::nullopt;
  const auto blocks_level = static_cast<int>(manifest.done_blocks().level());
  if (*level < blocks_level || *level > finest) return std::nullopt;
  if (wanted.tile) return std::vector{wanted.tile->at_level(blocks_level)};
  const MeshWindow window = window_of(shown, wanted, blocks_level);
  if ((window.x1 - window.x0 + 1) * (window.y1 - window.y0 + 1) > static_cast<std::int64_t>(kMostLooks)) return std::nullopt;
  std::vector<proto::TileAddress> blocks;
  for (std::int32_t y = window.y0; y <= window.y1; ++y) {
    for (std::int64_t x = window.x0; x <= window.x1; ++x)
      blocks.push_back({blocks_level, static_cast<std::int32_t>(proto::modulo(x, proto::tiles_across(blocks_level))), y});
  }
  return blocks;
}

/// An answer that comes when the mesh's blocks are done; none: they are, or the dataset needs no wait.
std::optional<Response> wait_for_blocks(Service& service, const Request& request, const Dataset& dataset, const Route& route,
                                        const MeshRequest& wanted, Opened& opened) {
  const proto::Manifest& shown = opened.terrain->manifest();
  if (!shown.provisional() || !route.version.empty()) return std::nullopt;
  if (wanted.level && *wanted.level > static_cast<int>(shown.max_level())) {
    if (shown.has_done_blocks()) return std::nullopt;  // no block will have it
    return not_made_yet(service, dataset);             // a first look, whose levels are not all that there will be
  }
  auto blocks = blocks_under(*opened.terrain, wanted);
  if (!blocks) {
    if (auto later = wait_for_all(service, request, dataset)) return later;
    opened = open_published(service, dataset, route);
    return opened.terrain ? std::nullopt : std::optional(std::move(opened.refusal));
  }
  std::erase_if(*blocks, [&](const proto::TileAddress& block) { return !is_to_come(dataset, &shown, block); });
  if (blocks->empty()) return std::nullopt;
  service.queue().look(dataset, *blocks, shown, JobQueue::Who::waits);
  auto later =
      wait_for(service, request, dataset, may_wait(service.settings().serve.limits, request), all_of(std::move(*blocks)));
  return later ? std::move(*later) : not_made_yet(service, dataset);
}

}  // namespace

Response extracted_mesh(Service& service, const Request& request, const Dataset& dataset, const Route& route) {
  const std::string ending = route.path.substr(route.path.find('.') + 1);
  const MeshKind kind = *mesh_kind(ending);
  auto wanted = mesh_request(request.query, Spelling::query);
  if (!wanted) return problem_response(wanted.problem());
  wanted->most_triangles = kMostTrianglesOverHttp;
  if (const auto held = check_frame(kind, wanted->frame); !held) return problem_response(held.problem());
  Opened opened = open_readable(service, dataset, route);
  if (!opened.terrain) return std::move(opened.refusal);
  if (auto answer = wait_for_blocks(service, request, dataset, route, *wanted, opened)) return std::move(*answer);
  const Turn turn;
  if (!turn.mine()) {
    return problem_response({"service-busy", "too many meshes are being made", "asking again in a few seconds", ""});
  }

  const auto mesh = extract_mesh(*opened.terrain, *wanted);
  if (!mesh) return problem_response(mesh.problem());
  const proto::Manifest& shown = opened.terrain->manifest();
  // The blocks have too many triangles on all of their levels, and above them nothing is final yet.
  if (shown.provisional() && mesh->level < static_cast<int>(shown.done_blocks().level())) {
    auto later = wait_for_all(service, request, dataset);
    return later ? std::move(*later) : open_published(service, dataset, route).refusal;
  }
  std::ostringstream bytes;
  write_mesh(bytes, *mesh, kind, opened.terrain->manifest());
  Response response;
  response.body = std::move(bytes).str();
  response.set("Content-Type", std::string(media_type(kind)));
  response.set("Content-Disposition", "inline; filename=\"" + file_name(dataset, *mesh, ending) + "\"");
  response.set("Cache-Control", cache_control(route));
  response.set("ETag", quoted(pipeline::hex(pipeline::content_hash(response.body))));
  response.set("Accept-Ranges", "bytes");
  return cut_to_range(request, if_changed(request, std::move(response)));
}

}  // namespace cordillera::server
