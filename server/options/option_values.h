#pragma once
// Text to value, for every place that options come from. A complaint says what is wrong with the text; nullopt: nothing is.
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/result.h"

namespace cordillera::server {

using Complaint = std::optional<std::string>;

/// A finite number within [least, greatest].
struct NumberRange {
  double least = 0;
  double greatest = 0;
};
Complaint read_number(std::string_view text, NumberRange range, double* out);

/// 12 and not 12.000000, 0.001 and not 1e-3.
std::string shown(double value);

/// A whole number within [least, greatest].
struct WholeRange {
  std::uint32_t least = 0;
  std::uint32_t greatest = 0;
};
Complaint read_whole(std::string_view text, WholeRange range, std::uint32_t* out);
/// "0 to 1024".
std::string accepted_in(WholeRange range);

/// Numbers between commas; every one within the range.
Complaint read_numbers(std::string_view text, NumberRange range, std::vector<double>* out);

/// "west,south,east,north" in degrees. A complaint about another order names this one.
Complaint read_box(std::string_view text, std::array<double, 4>* out);

/// One of the choices, whatever the case; out gets the choice as it is spelt there.
Complaint read_choice(std::string_view text, const std::vector<std::string>& choices, std::string* out);

/// 1, true, yes, on or nothing; 0, false, no, off.
Complaint read_switch(std::string_view text, bool* out);

/// UTF-8 without control characters, at most 1000 bytes: it goes into documents and logs.
Complaint read_text(std::string_view text, std::string* out);

/// What read_imagery takes, for refusals and for help.
inline constexpr const char* kImagery =
    "an address in Web Mercator with {z}, {x} and {y}, rows from the north: https://example.org/{z}/{x}/{y}.jpg";
/// The address of a tile of pictures, as maps have it: http or https, with {z}, {x} and {y} once each. It goes into pages, so it
/// has no character that an address must escape, but for those braces.
Complaint read_imagery(std::string_view text, std::string* out);

/// cpu, cuda, cuda:N or auto.
Complaint read_device(std::string_view text, std::string* out);

/// True if text is well-formed UTF-8 (no surrogates, no overlong forms).
bool is_utf8(std::string_view text);

/// What somebody sent, as an answer may repeat it: not much of it, and only text.
std::string quotable(const std::string& text, std::size_t most = 100);

/// "option-invalid" of a value that a complaint was made about.
proto::Problem wrong_value(const std::string& name, const std::string& value, const std::string& complaint,
                           const std::string& accepted);

/// The candidate nearest to name by edit distance, if it is near enough to be what was meant.
std::optional<std::string> nearest_name(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace cordillera::server
