#include "server/limits/space.h"

#include <algorithm>

namespace cordillera::server::limits {
namespace {

constexpr std::uint64_t kStep_bytes = std::uint64_t{16}
                                      << 20;  // set aside at once where the size is not known; between looks at the disk

}  // namespace

std::string Space::full_beside(std::uint64_t bytes, std::uint64_t aside) const {
  const auto disk = look_();
  if (!disk || room(*disk, free_percent_) > bytes + aside) return "";
  const std::string others =
      aside > 0 ? ", and " + std::to_string(aside >> 20) + " MiB are set aside for rasters that are on their way" : "";
  return "the disk has " + std::to_string(disk->free >> 20) + " MiB free" + others + "; " + std::to_string(free_percent_) +
         " % of its " + std::to_string(disk->size >> 20) + " MiB are kept free";
}

std::string Space::full(std::uint64_t bytes) const {
  const std::lock_guard lock(mutex_);
  return full_beside(bytes, aside_);
}

/// A step more, or just what is needed where a step does not fit.
std::string Space::grow(Claim& claim, std::uint64_t bytes) {
  for (const std::uint64_t more : {std::max(bytes, kStep_bytes), bytes}) {
    std::string why = full_beside(more, aside_);
    if (!why.empty() && more > bytes) continue;
    if (!why.empty()) return why;
    aside_ += more;
    claim.left_ += more;
    break;
  }
  return "";
}

std::unique_ptr<Space::Claim> Space::claim(std::uint64_t bytes, std::string* why) {
  const std::lock_guard lock(mutex_);
  *why = full_beside(bytes, aside_);
  if (!why->empty()) return nullptr;
  std::unique_ptr<Claim> claim(new Claim(*this));
  claim->left_ = bytes;
  aside_ += bytes;
  return claim;
}

Space::Claim::~Claim() {
  const std::lock_guard lock(space_.mutex_);
  space_.aside_ -= left_;
}

std::string Space::Claim::next(std::uint64_t bytes) {
  const std::lock_guard lock(space_.mutex_);
  space_.aside_ -= last_;
  left_ -= last_;
  since_ += last_;
  last_ = 0;
  std::string why;
  if (bytes > left_) {
    why = space_.grow(*this, bytes - left_);
    since_ = 0;
  } else if (since_ >= kStep_bytes) {
    why = space_.full_beside(bytes, 0);  // other programs write on this disk too
    since_ = 0;
  }
  if (why.empty()) last_ = bytes;
  return why;
}

}  // namespace cordillera::server::limits
