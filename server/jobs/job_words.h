#pragma once
// What a job writes to stderr: libraries' complaints, and the last words of a crash. Strangers' files have a say in it, so it is
// bounded.
#include <cstddef>
#include <string>

namespace cordillera::server {

class JobWords {
 public:
  explicit JobWords(std::string job) : job_(std::move(job)) {}

  /// Logs each line that is whole. A long one is cut, and after kMostBytes of a job the rest is left out.
  void take(const char* bytes, std::size_t count);
  /// The last line need not have an end.
  void end();

  static constexpr std::size_t kMostBytes = std::size_t{64} << 10, kLongestLine = 1000;

 private:
  void say();

  const std::string job_;
  std::string line_;
  std::size_t taken_ = 0;
  bool too_many_ = false;
};

}  // namespace cordillera::server
