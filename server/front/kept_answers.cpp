#include "server/front/kept_answers.h"

#include <utility>

#include "server/front/message/answer_head.h"

namespace cordillera::server::front {
namespace {

bool is_of_request(const std::string& name) { return name == "X-Request-Id" || name == "Server-Timing"; }

bool stays_in_304(const std::string& name) {
  return name == "ETag" || name == "Cache-Control" || name == "Vary" || name.starts_with("Access-Control-") ||
         name == "X-Content-Type-Options";
}

}  // namespace

void KeptAnswers::keep(const std::string& path, const Response& response) {
  if (!response.same_while || response.status != 200 || !response.shared) return;
  auto kept = std::make_shared<KeptAnswer>();
  kept->state = *response.same_while;
  kept->counts = response.counts;
  kept->etag = response.header("ETag");
  kept->body = response.shared;
  std::string lines, unchanged;
  for (const auto& [name, value] : response.headers) {
    if (!is_of_request(name)) add_header(lines, name, value);
    if (stays_in_304(name)) add_header(unchanged, name, value);
  }
  add_header(lines, "Server-Timing", "make;dur=0");  // it is found, not made
  kept->lines = std::make_shared<const std::string>(std::move(lines));
  kept->unchanged = std::make_shared<const std::string>(std::move(unchanged));
  const std::size_t bytes = path.size() + kept->lines->size() + kept->unchanged->size() + kept->body->size() + sizeof(KeptAnswer);
  shelf(path).replace(path, std::move(kept), bytes);
}

std::shared_ptr<const KeptAnswer> KeptAnswers::find(const std::string& path, std::uint64_t state) {
  if (state_ != state) forget_others(state);
  const auto found = shelf(path).find(path);
  return found && (*found)->state == state ? *found : nullptr;
}

/// What a deleted dataset left would stay here for long.
void KeptAnswers::forget_others(std::uint64_t state) {
  state_ = state;
  for (Shelf& shelf : shelves_) shelf.clear();
}

bool takes_kept(const Request& request) {
  return request.method == "GET" && request.query.empty() && !request.headers.contains("authorization") &&
         !request.headers.contains("range") && !request.headers.contains("if-match");
}

}  // namespace cordillera::server::front
