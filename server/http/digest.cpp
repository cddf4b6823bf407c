#include "server/http/digest.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/rand.h>

#include <fstream>
#include <new>
#include <span>
#include <stdexcept>
#include <vector>

#include "proto/letters.h"

namespace cordillera::server {
namespace {

std::vector<unsigned char> random_bytes(std::size_t count) {
  std::vector<unsigned char> bytes(count);
  if (RAND_bytes(bytes.data(), static_cast<int>(count)) != 1) throw std::runtime_error("no random numbers can be had");
  return bytes;
}

/// Of these functions' reasons to fail there is one here: OpenSSL 3 takes memory for every digest.
void expect(int done) {
  if (done != 1) throw std::bad_alloc();
}

}  // namespace

struct Digest::State {
  EVP_MD_CTX* context = EVP_MD_CTX_new();
  State() {
    if (context == nullptr) throw std::bad_alloc();
  }
  ~State() { EVP_MD_CTX_free(context); }
};

Digest::Digest() : state_(std::make_unique<State>()) { expect(EVP_DigestInit_ex(state_->context, EVP_sha256(), nullptr)); }
Digest::~Digest() = default;

void Digest::add(std::string_view bytes) { expect(EVP_DigestUpdate(state_->context, bytes.data(), bytes.size())); }

bool same_secret(std::string_view one, std::string_view other) {
  return one.size() == other.size() && CRYPTO_memcmp(one.data(), other.data(), one.size()) == 0;
}

std::string random_letters(std::size_t count) {
  static constexpr char kLetters[] = "abcdefghijkmnpqrstuvwxyz23456789";  // 32, none easily taken for another
  std::string word;
  for (const unsigned char byte : random_bytes(count)) word += kLetters[byte % 32];
  return word;
}

std::string random_hex(std::size_t bytes) { return proto::hex(random_bytes(bytes)); }

std::string Digest::finish() {
  unsigned char bytes[EVP_MAX_MD_SIZE];
  unsigned int count = 0;
  expect(EVP_DigestFinal_ex(state_->context, bytes, &count));
  return proto::hex(std::span(bytes, count));
}

std::optional<std::string> digest_of(std::istream& in, const std::function<void(std::string_view piece)>& take) {
  Digest digest;
  for (std::string buffer(1 << 20, '\0'); in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())), in.gcount() > 0;) {
    const std::string_view piece = std::string_view(buffer).substr(0, static_cast<std::size_t>(in.gcount()));
    digest.add(piece);
    take(piece);
  }
  return in.eof() ? std::optional(digest.finish()) : std::nullopt;
}

std::string digest_of_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return digest_of(in, [](std::string_view) {}).value_or("");
}

std::string digest(std::string_view bytes) {
  Digest digest;
  digest.add(bytes);
  return digest.finish();
}

}  // namespace cordillera::server
