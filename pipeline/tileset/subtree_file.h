#pragma once
// The container of a binary subtree (3D Tiles 1.1, implicit tiling): one JSON chunk, one binary chunk of 8-byte aligned buffer
// views.
#include <cstddef>
#include <string>

#include "pipeline/encode/json.h"

namespace cordillera::pipeline {

/// Availability of so many places, the lowest bit of a byte first.
class AvailabilityBits {
 public:
  explicit AvailabilityBits(std::size_t count) : count_(count), bytes_((count + 7) / 8, '\0') {}
  void set(std::size_t i) {
    bytes_[i / 8] = static_cast<char>(bytes_[i / 8] | 1 << (i % 8));
    ++set_;
  }
  std::size_t available() const { return set_; }
  bool uniform() const { return set_ == 0 || set_ == count_; }
  const std::string& bytes() const { return bytes_; }

 private:
  std::size_t count_, set_ = 0;
  std::string bytes_;
};

class SubtreeFile {
 public:
  /// The number of a new buffer view.
  std::size_t add(const std::string& part);
  /// What the JSON says of some bits: a constant where all are equal, else a bitstream of this file.
  Json availability(const AvailabilityBits& bits);
  /// json: everything but the buffer and its views.
  std::string bytes(const Json& json) const;

 private:
  Json views_ = Json::array();
  std::string binary_;
};

}  // namespace cordillera::pipeline
