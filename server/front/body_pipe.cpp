#include "server/front/body_pipe.h"

namespace cordillera::server::front {

bool BodyPipe::push(std::string piece) {
  const std::lock_guard lock(mutex_);
  bytes_ += piece.size();
  if (!piece.empty()) pieces_.push_back(std::move(piece));
  full_ = bytes_ >= kMostBytes;
  news_.notify_one();
  return !full_;
}

void BodyPipe::end(End end) {
  const std::lock_guard lock(mutex_);
  if (!end_) end_ = end;
  news_.notify_one();
}

std::optional<std::string> BodyPipe::pop() {
  std::unique_lock lock(mutex_);
  const bool first = !touched_;
  touched_ = true;
  if (first) wanted_();
  news_.wait(lock, [&] { return !pieces_.empty() || end_; });
  if (pieces_.empty()) return std::nullopt;
  std::string piece = std::move(pieces_.front());
  pieces_.pop_front();
  bytes_ -= piece.size();
  if (full_ && bytes_ < kMostBytes / 2) {
    full_ = false;
    wanted_();
  }
  return piece;
}

bool BodyPipe::whole() const {
  const std::lock_guard lock(mutex_);
  return pieces_.empty() && end_ == End::whole;
}

}  // namespace cordillera::server::front
