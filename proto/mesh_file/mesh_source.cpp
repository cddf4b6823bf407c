#include "proto/mesh_file/mesh_source.h"

#include <algorithm>
#include <cstring>

namespace cordillera::proto {
namespace {

constexpr std::size_t kBuffer = std::size_t{1} << 16;
constexpr std::uint64_t kLeastElement = 3;  // bytes: no format has a shorter vertex or triangle

}  // namespace

MeshSource::MeshSource(std::istream& in, std::string name) : in_(in), name_(std::move(name)), buffer_(kBuffer) {
  // A pipe cannot be asked: room is then made as elements come.
  const auto start = in_.tellg();
  if (start < 0 || !in_.seekg(0, std::ios::end)) {
    in_.clear();
    return;
  }
  size_ = static_cast<std::uint64_t>(in_.tellg() - start);
  in_.seekg(start);
}

bool MeshSource::fill() {
  passed_ += filled_;
  at_ = filled_ = 0;
  in_.read(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  filled_ = static_cast<std::size_t>(in_.gcount());
  return filled_ > 0;
}

bool MeshSource::read(char* to, std::size_t count) {
  while (count > 0) {
    if (at_ == filled_ && !fill()) return false;
    const std::size_t piece = std::min(count, filled_ - at_);
    std::memcpy(to, buffer_.data() + at_, piece);
    at_ += piece;
    to += piece;
    count -= piece;
  }
  return true;
}

bool MeshSource::skip(std::uint64_t count) {
  while (count > 0) {
    if (at_ == filled_ && !fill()) return false;
    const std::size_t piece = static_cast<std::size_t>(std::min<std::uint64_t>(count, filled_ - at_));
    at_ += piece;
    count -= piece;
  }
  return true;
}

bool MeshSource::begins_with(std::string_view text) {
  peek();
  return std::string_view(buffer_.data() + at_, filled_ - at_).substr(0, text.size()) == text;
}

std::size_t MeshSource::room_for(std::uint64_t announced) const {
  return static_cast<std::size_t>(std::min(announced, size_ / kLeastElement));
}

Problem MeshSource::invalid_line(std::uint64_t line, const std::string& what, const std::string& accepted) const {
  return {"mesh-file-invalid", name_ + ", line " + std::to_string(line) + ": " + what, accepted, ""};
}

Problem MeshSource::invalid_byte(std::uint64_t byte, const std::string& what, const std::string& accepted) const {
  return {"mesh-file-invalid", name_ + ", byte " + std::to_string(byte) + ": " + what, accepted, ""};
}

Problem MeshSource::short_line(const std::string& what) const {
  return {"mesh-file-short", name_ + ", line " + std::to_string(line_) + ": the file ends within " + what, "a whole file", ""};
}

Problem MeshSource::short_byte(const std::string& what) const {
  return {"mesh-file-short", name_ + ", byte " + std::to_string(byte()) + ": the file ends within " + what, "a whole file", ""};
}

}  // namespace cordillera::proto
