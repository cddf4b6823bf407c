#pragma once
// SHA-256, to tell whether two requests carry the same bytes.
#include <memory>
#include <string>
#include <string_view>

namespace cordillera::server {

class Digest {
 public:
  Digest();
  ~Digest();
  void add(std::string_view bytes);
  /// Hex. Ends the digest.
  std::string finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

std::string digest(std::string_view bytes);

}  // namespace cordillera::server
