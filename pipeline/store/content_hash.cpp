#include "pipeline/store/content_hash.h"

#include <openssl/evp.h>
#include <openssl/sha.h>

#include <array>
#include <new>
#include <stdexcept>

namespace cordillera::pipeline {

std::string content_hash(std::string_view bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest;
  // OpenSSL 3 takes memory for it. Without any it leaves the digest as it is.
  if (SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest.data()) == nullptr)
    throw std::bad_alloc();
  return {digest.begin(), digest.begin() + kHashBytes};
}

std::string md5(std::string_view bytes) {
  std::string digest(16, '\0');
  auto* out = reinterpret_cast<unsigned char*>(digest.data());
  if (EVP_Digest(bytes.data(), bytes.size(), out, nullptr, EVP_md5(), nullptr) != 1)
    throw std::runtime_error("OpenSSL has no MD5");
  return digest;
}

}  // namespace cordillera::pipeline
