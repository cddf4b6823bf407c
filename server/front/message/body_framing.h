#pragma once
// Where a request's body ends: after so many bytes, or where its chunks say.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/front/message/beast.h"
#include "server/front/message/head.h"

namespace cordillera::server::front {

class BodyFraming {
 public:
  explicit BodyFraming(const Head& head);

  /// Appends what belongs to the body to *body and returns how many of the bytes were used: all, unless the body ends among them
  /// or they break the rules.
  std::size_t take(std::string_view bytes, std::string* body);
  bool done() const { return chunks_ ? chunks_->done() : left_ == 0; }
  bool broken() const { return chunks_ && chunks_->broken(); }

 private:
  std::optional<ChunkParser> chunks_;
  std::uint64_t left_ = 0;  ///< of a sized body
};

}  // namespace cordillera::server::front
