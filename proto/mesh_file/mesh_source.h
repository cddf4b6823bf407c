#pragma once
// A mesh file as it is read: bytes through one buffer, and where we are, for errors.
#include <cstddef>
#include <cstdint>
#include <istream>
#include <string>
#include <string_view>
#include <vector>

#include "proto/result.h"

namespace cordillera::proto {

class MeshSource {
 public:
  /// Borrows the stream.
  MeshSource(std::istream& in, std::string name);

  static constexpr int kEnd = -1;
  /// The next byte, or kEnd.
  int peek() { return at_ < filled_ || fill() ? static_cast<unsigned char>(buffer_[at_]) : kEnd; }
  int get() {
    const int byte = peek();
    if (byte == kEnd) return kEnd;
    ++at_;
    if (byte == '\n') ++line_;
    return byte;
  }
  /// False if the file ends before. Lines are not counted in what is read so.
  bool read(char* to, std::size_t count);
  bool skip(std::uint64_t count);
  /// Whether the file begins so; only before anything was read.
  bool begins_with(std::string_view text);

  const std::string& name() const { return name_; }
  std::uint64_t line() const { return line_; }          ///< from 1
  std::uint64_t byte() const { return passed_ + at_; }  ///< from 0, of the next byte
  /// How many elements to make room for: as many as are announced, but no more than the file has bytes for.
  std::size_t room_for(std::uint64_t announced) const;

  Problem invalid_line(std::uint64_t line, const std::string& what, const std::string& accepted) const;
  Problem invalid_byte(std::uint64_t byte, const std::string& what, const std::string& accepted) const;
  /// The file ends too early: what was being read.
  Problem short_line(const std::string& what) const;
  Problem short_byte(const std::string& what) const;

 private:
  bool fill();

  std::istream& in_;
  std::string name_;
  std::vector<char> buffer_;
  std::size_t at_ = 0, filled_ = 0;
  std::uint64_t passed_ = 0;  // bytes of earlier fills
  std::uint64_t line_ = 1;
  std::uint64_t size_ = 0;  // 0: not known
};

}  // namespace cordillera::proto
