#include "server/http/request_id.h"

#include <algorithm>
#include <random>

#include "proto/letters.h"

namespace cordillera::server {
namespace {

bool fine(char c) { return proto::is_letter_or_digit(c) || c == '.' || c == '-' || c == '_' || c == ':'; }

}  // namespace

std::string request_id_of(const Request& request) {
  const auto sent = request.header("x-request-id");
  if (sent && !sent->empty() && sent->size() <= 64 && std::all_of(sent->begin(), sent->end(), fine)) return *sent;
  // Told apart, not kept secret: no more is asked of it.
  thread_local std::mt19937_64 numbers{(std::uint64_t{std::random_device{}()} << 32) ^ std::random_device{}()};
  std::uint64_t number = numbers();
  std::string id;
  for (int i = 0; i < 16; ++i, number >>= 4) id += "0123456789abcdef"[number & 15];
  return id;
}

}  // namespace cordillera::server
