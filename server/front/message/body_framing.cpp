#include "server/front/message/body_framing.h"

#include <algorithm>

namespace cordillera::server::front {

BodyFraming::BodyFraming(const Head& head) : left_(head.body == Head::Body::sized ? head.length : 0) {
  if (head.body == Head::Body::chunked) chunks_.emplace();
}

std::size_t BodyFraming::take(std::string_view bytes, std::string* body) {
  if (chunks_) return chunks_->take(bytes, body);
  const std::size_t count = static_cast<std::size_t>(std::min<std::uint64_t>(left_, bytes.size()));
  body->append(bytes.substr(0, count));
  left_ -= count;
  return count;
}

}  // namespace cordillera::server::front
