#include "proto/mesh_file/text_lines.h"

namespace cordillera::proto {
namespace {

bool blank(int byte) { return byte == ' ' || byte == '\t' || byte == '\r' || byte == '\v' || byte == '\f'; }

}  // namespace

/// Up to a word or the end of the line.
void TextLines::pass_blanks() {
  for (;;) {
    while (blank(source_.peek())) source_.get();
    if (continuation_ == 0 || source_.peek() != continuation_) return;
    source_.get();
    while (source_.peek() == '\r') source_.get();
    if (source_.peek() == '\n') source_.get();
  }
}

bool TextLines::ends_word(int byte) const {
  if (byte == MeshSource::kEnd || byte == '\n' || blank(byte)) return true;
  return (comment_ != 0 && byte == comment_) || (continuation_ != 0 && byte == continuation_);
}

bool TextLines::next() {
  while (line_ > 0 && !word().empty()) {}
  for (;;) {
    pass_blanks();
    int byte = source_.peek();
    if (comment_ != 0 && byte == comment_) {
      while (byte != '\n' && byte != MeshSource::kEnd) {
        source_.get();
        byte = source_.peek();
      }
    }
    if (byte == MeshSource::kEnd) return false;
    if (byte != '\n') break;
    source_.get();
  }
  line_ = source_.line();
  return true;
}

std::string_view TextLines::word() {
  word_.clear();
  pass_blanks();
  for (int byte = source_.peek(); !ends_word(byte); byte = source_.peek()) {
    if (word_.size() <= kLongestWord) word_.push_back(word_.size() < kLongestWord ? static_cast<char>(byte) : '?');
    source_.get();
  }
  return word_;
}

std::string shown(std::string_view word) {
  constexpr std::size_t kMost = 24;
  std::string text = "'";
  for (const char c : word.substr(0, kMost)) text.push_back(c >= ' ' && c <= '~' ? c : '?');
  return text + (word.size() > kMost ? "…'" : "'");
}

}  // namespace cordillera::proto
