#pragma once
// SHA-256, to tell whether two requests carry the same bytes, and what else is asked of the library of ciphers.
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <memory>
#include <optional>
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

/// The digest of what is left of a stream, whose pieces are handed on; nothing where it cannot be read to its end.
std::optional<std::string> digest_of(std::istream& in, const std::function<void(std::string_view piece)>& take);

/// The digest of a file; empty when it cannot be read.
std::string digest_of_file(const std::filesystem::path& file);

/// Whether they are equal; how long it takes depends on the lengths alone.
bool same_secret(std::string_view one, std::string_view other);

/// What nobody can guess: lower-case letters and digits, 5 bits each; bytes as hex.
std::string random_letters(std::size_t count);
std::string random_hex(std::size_t bytes);

}  // namespace cordillera::server
