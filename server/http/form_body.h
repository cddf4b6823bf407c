#pragma once
// multipart/form-data (RFC 7578) as it comes, from curl -F or a page's form: its files go on in pieces, its fields are kept.
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/result.h"

namespace cordillera::server {

class FormReader {
 public:
  /// The reader for a request with this Content-Type; none: another type, or a boundary that is too long. A type without a
  /// boundary, as scripts set it by hand, leaves it to the first line of the body.
  static std::optional<FormReader> of(const std::string& content_type);

  static constexpr std::size_t kMostFiles = 256;
  static constexpr std::size_t kMostParts = 512;  ///< files and fields
  /// A piece of the file that file_names() ends with.
  using Sink = std::function<bool(std::string_view piece)>;
  /// False: no more of it. Either the sink said so, or problem() does.
  bool feed(std::string_view piece, const Sink& file);
  /// Whether its last boundary has come; what follows means nothing.
  bool ended() const { return state_ == State::epilogue; }
  const std::optional<proto::Problem>& problem() const { return problem_; }

  /// Names of the files so far, without folders; the file that is coming is the last. A name may be empty.
  const std::vector<std::string>& file_names() const { return file_names_; }
  /// In the order sent.
  const std::vector<std::pair<std::string, std::string>>& fields() const { return fields_; }

 private:
  enum class State { preamble, boundary, head, field, file, epilogue };
  /// boundary: empty where the body is to say it.
  explicit FormReader(const std::string& boundary) : delimiter_(boundary.empty() ? "" : "\r\n--" + boundary), rest_("\r\n") {}
  /// The delimiter from the first line; false: it has not come, or is none.
  bool take_delimiter();
  /// One step over what has come; false: more is needed, or it is over.
  bool step(const Sink& file);
  bool content(const Sink& file);
  bool head();
  bool keep(std::size_t bytes);
  bool give(std::string_view bytes, const Sink& file);
  bool fail(const std::string& why);

  std::string delimiter_, rest_;
  State state_ = State::preamble;
  bool going_ = true;
  std::size_t kept_ = 0, parts_ = 0;  ///< bytes of fields
  std::vector<std::string> file_names_;
  std::vector<std::pair<std::string, std::string>> fields_;
  std::optional<proto::Problem> problem_;
};

}  // namespace cordillera::server
