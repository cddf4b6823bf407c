#pragma once
// Numbers in the byte order of glTF and 3D Tiles, whatever the machine's own.
#include <bit>
#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>

namespace cordillera::pipeline {

template <std::unsigned_integral T>
void append_little_endian(std::string& out, T value) {
  for (std::size_t k = 0; k < sizeof(T); ++k) out.push_back(static_cast<char>(static_cast<std::uint8_t>(value >> (8 * k))));
}
inline void append_little_endian(std::string& out, double value) {
  append_little_endian(out, std::bit_cast<std::uint64_t>(value));
}

/// at + sizeof(T) must not exceed bytes.size().
template <std::unsigned_integral T>
T little_endian_at(std::string_view bytes, std::size_t at) {
  T value = 0;
  for (std::size_t k = 0; k < sizeof(T); ++k)
    value = static_cast<T>(value | T{static_cast<std::uint8_t>(bytes[at + k])} << (8 * k));
  return value;
}

/// Appends fill until out.size() is a multiple of alignment.
inline void pad(std::string& out, std::size_t alignment, char fill) {
  out.append((alignment - out.size() % alignment) % alignment, fill);
}

}  // namespace cordillera::pipeline
