#include "server/limits/space.h"

#include <algorithm>

namespace cordillera::server::limits {
namespace {

constexpr std::uint64_t kStep_bytes = std::uint64_t{16}
                                      << 20;  // set aside at once where the size is not known; between looks at the disk

}  // namespace

void Space::set_spare(Spare spare) {
  const std::lock_guard lock(mutex_);
  spare_ = std::move(spare);
}

std::string Space::full_beside(std::uint64_t bytes, std::uint64_t aside, bool may_remove) const {
  auto disk = look_();
  const auto lacks = [&] {
    const std::uint64_t there = disk ? room(*disk, free_percent_) : UINT64_MAX;
    return there > bytes + aside ? 0 : bytes + aside - there + 1;
  };
  while (may_remove && spare_ && lacks() > 0 && spare_(lacks())) disk = look_();
  if (lacks() == 0) return "";
  const std::string others =
      aside > 0 ? ", and " + std::to_string(aside >> 20) + " MiB are set aside for rasters that are on their way" : "";
  return "the disk has " + std::to_string(disk->free >> 20) + " MiB free" + others + "; " + std::to_string(free_percent_) +
         " % of its " + std::to_string(disk->size >> 20) + " MiB are kept free";
}

std::string Space::full(std::uint64_t bytes) const {
  const std::lock_guard lock(mutex_);
  return full_beside(bytes, aside_, true);
}

/// A step more, or just what is needed where a step does not fit.
std::string Space::grow(Claim& claim, std::uint64_t bytes) {
  for (const std::uint64_t more : {std::max(bytes, kStep_bytes), bytes}) {
    std::string why = full_beside(more, aside_, claim.may_remove_ && more == bytes);
    if (!why.empty() && more > bytes) continue;
    if (!why.empty()) return why;
    aside_ += more;
    claim.left_ += more;
    break;
  }
  return "";
}

std::unique_ptr<Space::Claim> Space::claim(std::uint64_t bytes, std::string* why, bool may_remove) {
  const std::lock_guard lock(mutex_);
  *why = full_beside(bytes, aside_, may_remove);
  if (!why->empty()) return nullptr;
  std::unique_ptr<Claim> claim(new Claim(*this, may_remove));
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
    why = space_.full_beside(bytes, 0, may_remove_);  // other programs write on this disk too
    since_ = 0;
  }
  if (why.empty()) last_ = bytes;
  return why;
}

}  // namespace cordillera::server::limits
