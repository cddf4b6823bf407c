#pragma once
// HTTP/1.1 as Boost.Beast reads it. It takes more than we do: the gate over what it reads is in head.cpp and body_framing.cpp.
// The only file behind this header knows Beast.
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cordillera::server::front {

/// What a head says, as views into its bytes. Values are without blanks around them, and hold no control characters but tabs.
struct RawHead {
  std::string_view method, target;
  bool old = false;  ///< HTTP/1.0
  std::vector<std::pair<std::string_view, std::string_view>> fields;
};

/// bytes: a whole head without folded lines. Empty: it was read; else what is wrong, in words.
std::string parse_head(std::string_view bytes, RawHead* head);

/// The words behind a status.
std::string_view reason_of(int status);

/// The chunks of a body, and what comes behind the last of them.
class ChunkParser {
 public:
  ChunkParser();
  ~ChunkParser();

  /// Appends the data to *body and returns how many of the bytes were used: all, unless the body ends among them or they break
  /// the rules.
  std::size_t take(std::string_view bytes, std::string* body);
  bool done() const;
  bool broken() const { return broken_; }

 private:
  class Parser;
  std::unique_ptr<Parser> parser_;
  std::string held_;  ///< the beginning of a line that Beast wants whole
  bool broken_ = false;
};

}  // namespace cordillera::server::front
