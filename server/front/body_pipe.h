#pragma once
// A body on its way from the loop that receives it to the thread that handles it, with little in between.
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

namespace cordillera::server::front {

/// Thread-safe: one side pushes, the other pops.
class BodyPipe {
 public:
  /// wanted: called by the popping thread when it asks for the first piece, and whenever a full pipe has room again.
  explicit BodyPipe(std::function<void()> wanted) : wanted_(std::move(wanted)) {}

  /// True if there is room for more.
  bool push(std::string piece);
  enum class End { whole, broken };
  /// Nothing comes any more.
  void end(End end);

  /// Waits. Nothing: the end.
  std::optional<std::string> pop();
  /// The end was reached, and everything before it has been taken.
  bool whole() const;

 private:
  static constexpr std::size_t kMostBytes = std::size_t{1} << 20;

  std::function<void()> wanted_;
  mutable std::mutex mutex_;
  std::condition_variable news_;
  std::deque<std::string> pieces_;
  std::size_t bytes_ = 0;
  bool touched_ = false, full_ = false;
  std::optional<End> end_;
};

}  // namespace cordillera::server::front
