// Addresses of everything a server has, and query strings. "path?query", as a request line has them.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "server/front/target.h"
#include "server/options.h"
#include "server/problems.h"
#include "server/routes.h"

using namespace cordillera::server;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto target = front::read_target(std::string_view(reinterpret_cast<const char*>(data), size));
  if (!target) return 0;
  const Route route = parse_route(target->path);
  if (allowed_methods(route.resource).empty() || route_name(route).empty()) __builtin_trap();
  // An id becomes a folder's name.
  if (route.id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") != std::string::npos) __builtin_trap();
  const auto settings = with_layer(Settings(), build_options(), target->query, Spelling::query);
  if (!settings && problem_kind(settings.problem().type).status < 400) __builtin_trap();
  return 0;
}
