#include "server/front/body_framing.h"

#include <algorithm>

namespace cordillera::server::front {
namespace {

constexpr std::size_t kMostSizeDigits = 15;
constexpr std::size_t kMostOverhead = 8192;  // in all chunks of a body together, beyond their data

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

bool is_control(char c) { return (static_cast<unsigned char>(c) < 0x20 && c != '\t') || c == 0x7f; }

}  // namespace

BodyFraming::BodyFraming(const Head& head)
    : chunked_(head.body == Head::Body::chunked), part_(chunked_ ? Part::size : Part::data), left_(chunked_ ? 0 : head.length) {
  if (head.body == Head::Body::none) part_ = Part::done;
}

std::size_t BodyFraming::take(std::string_view bytes, std::string* body) {
  std::size_t used = 0;
  while (used < bytes.size() && !done() && !broken()) {
    if (part_ == Part::data) {
      used += take_data(bytes.substr(used), body);
    } else {
      step(bytes[used++]);
    }
  }
  return used;
}

std::size_t BodyFraming::take_data(std::string_view bytes, std::string* body) {
  const std::size_t count = static_cast<std::size_t>(std::min<std::uint64_t>(left_, bytes.size()));
  body->append(bytes.data(), count);
  left_ -= count;
  if (left_ == 0) part_ = chunked_ ? Part::data_end : Part::done;
  return count;
}

void BodyFraming::end_of_size() {
  if (line_ == 0) {
    part_ = Part::broken;
    return;
  }
  part_ = left_ > 0 ? Part::data : Part::trailer;
  line_ = 0;
}

/// One byte of what is not data.
void BodyFraming::step(char c) {
  const auto only = [&](char wanted, Part next) { part_ = c == wanted ? next : Part::broken; };
  switch (part_) {
    case Part::size:
      if (const int digit = hex_digit(c); digit >= 0 && line_ < kMostSizeDigits) {
        left_ = left_ * 16 + static_cast<std::uint64_t>(digit);
        ++line_;
      } else if (c == ';' && line_ > 0) {
        part_ = Part::extension;
      } else {
        only('\r', Part::size_end);
      }
      break;
    case Part::extension:
      if (c == '\r') {
        part_ = Part::size_end;
      } else if (is_control(c) || ++overhead_ > kMostOverhead) {
        part_ = Part::broken;
      }
      break;
    case Part::size_end:
      only('\n', Part::size);
      if (!broken()) end_of_size();
      break;
    case Part::data_end: only('\r', Part::data_end_lf); break;
    case Part::data_end_lf: only('\n', Part::size); break;
    case Part::trailer:
      if (c == '\r') {
        part_ = line_ == 0 || colon_ ? Part::trailer_lf : Part::broken;
      } else if (is_control(c) || ++overhead_ > kMostOverhead) {
        part_ = Part::broken;
      } else {
        colon_ = colon_ || (c == ':' && line_ > 0);
        ++line_;
      }
      break;
    case Part::trailer_lf:
      only('\n', line_ == 0 ? Part::done : Part::trailer);
      line_ = 0;
      colon_ = false;
      break;
    default: break;
  }
}

}  // namespace cordillera::server::front
