#pragma once
// Bad input is a value, not an exception. A Problem is what a user reads: RFC 9457 over HTTP, one line on the command line.
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace cordillera::proto {

/// What went wrong, told to the one who can mend it.
struct Problem {
  std::string type;       ///< stable slug, e.g. "raster-not-georeferenced"; the documents list them all
  std::string detail;     ///< one sentence: the file or parameter, and what is wrong with it
  std::string accepted;   ///< what would be accepted instead; may be empty
  std::string parameter;  ///< the parameter at fault, as the user spelt it; may be empty

  /// One line for a terminal: "detail; accepted: …".
  std::string line() const { return accepted.empty() ? detail : detail + "; accepted: " + accepted; }
};

/// A T, or the Problem that kept us from making one.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}            // NOLINT: implicit on purpose
  Result(Problem problem) : state_(std::in_place_index<1>, std::move(problem)) {}  // NOLINT: implicit on purpose

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  const Problem& problem() const { return std::get<1>(state_); }

 private:
  std::variant<T, Problem> state_;
};

/// Success without a value.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Problem problem) : problem_(std::move(problem)) {}  // NOLINT: implicit on purpose
  bool ok() const { return !problem_; }
  explicit operator bool() const { return ok(); }
  const Problem& problem() const { return *problem_; }

 private:
  std::optional<Problem> problem_;
};

}  // namespace cordillera::proto
