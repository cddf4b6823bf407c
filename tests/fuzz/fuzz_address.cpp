// Addresses of everything a server has, and what their queries and bodies may ask for. "path?query", as a request line has them;
// what is none is taken for the body of an elevation query. And each for where a host leads whom it was asked for a raster.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "server/api/requests/elevation_query.h"
#include "server/api/requests/routes.h"
#include "server/fetch/addresses.h"
#include "server/front/message/target.h"
#include "server/http/problems.h"
#include "server/options/mesh_options.h"
#include "server/options/options.h"

using namespace cordillera;
using namespace cordillera::server;

namespace {

template <class T>
void answered(const proto::Result<T>& result) {
  if (!result && (problem_kind(result.problem().type).status < 400 || result.problem().detail.empty())) __builtin_trap();
}

void ask_elevation(const Request& request) {
  const auto query = elevation_query(request, 0, 20);
  answered(query);
  if (!query) return;
  if (query->places.size() > kMostPlaces || (query->level && (*query->level < 0 || *query->level > 20))) __builtin_trap();
  for (const auto& place : query->places) {
    if (!(std::abs(place.longitude_deg) <= 180 && std::abs(place.latitude_deg) <= 90)) __builtin_trap();
  }
}

/// Where it may be followed, it is within the prefix, and leads to itself.
void follow(std::string_view text) {
  static const ServeSettings settings = [] {
    ServeSettings made;
    made.source_allow = {"http://host/tiles/"};
    return made;
  }();
  const auto next = updates::led_to(settings, "http://host/tiles/a/b.tif", std::string(text));
  answered(next);
  if (!next) return;
  const std::string path = next->substr(0, next->find_first_of("?#"));
  if (!path.starts_with("http://host/tiles/") || (path + "/").find("/../") != path.npos) __builtin_trap();
  const auto again = updates::led_to(settings, *next, *next);
  if (!again || *again != *next) __builtin_trap();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  follow(text);
  const auto target = front::read_target(text);
  Request request;
  if (!target) {
    request.method = "POST";
    request.read_body = [text](const Request::Sink& sink) { return sink(text); };
    ask_elevation(request);
    return 0;
  }
  const Route route = parse_route(target->path);
  if (allowed_methods(route).empty() || route_name(route).empty()) __builtin_trap();
  // An id becomes a folder's name.
  if (route.id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") != std::string::npos) __builtin_trap();
  answered(with_layer(Settings(), build_options(), target->query, Spelling::query));
  answered(mesh_request(target->query, Spelling::query));
  request.query = target->query;
  ask_elevation(request);
  return 0;
}
