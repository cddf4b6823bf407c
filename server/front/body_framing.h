#pragma once
// Where a request's body ends: after so many bytes, or where its chunks say.
#include <cstdint>
#include <string>
#include <string_view>

#include "server/front/head.h"

namespace cordillera::server::front {

class BodyFraming {
 public:
  explicit BodyFraming(const Head& head);

  /// Appends what belongs to the body to *body and returns how many of the bytes were used: all, unless the body ends among them or
  /// they break the rules.
  std::size_t take(std::string_view bytes, std::string* body);
  bool done() const { return part_ == Part::done; }
  bool broken() const { return part_ == Part::broken; }

 private:
  enum class Part : std::uint8_t { data, size, extension, size_end, data_end, data_end_lf, trailer, trailer_lf, done, broken };
  void step(char c);
  void end_of_size();
  std::size_t take_data(std::string_view bytes, std::string* body);

  bool chunked_;
  Part part_;
  std::uint64_t left_ = 0;     ///< of the sized body, or of the chunk
  std::size_t line_ = 0;       ///< bytes of the size or the trailer line
  bool colon_ = false;         ///< the trailer line has a name
  std::size_t overhead_ = 0;   ///< bytes of extensions and trailers, which nobody reads
};

}  // namespace cordillera::server::front
