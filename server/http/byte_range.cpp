#include "server/http/byte_range.h"

#include <algorithm>

#include "proto/letters.h"
#include "proto/numbers.h"
#include "server/http/json.h"

namespace cordillera::server {
namespace {

/// Empty is no number here; one that does not fit is as large as one can be.
std::optional<std::uint64_t> position(std::string_view text) {
  if (text.empty() || text.find_first_not_of("0123456789") != text.npos) return std::nullopt;
  return proto::number<std::uint64_t>(text).value_or(UINT64_MAX);
}

/// The one range of a header in bytes; nothing where it has none or several. Lists may have empty elements and blanks around them
/// (RFC 9110, 5.6.1), and units are spelt in any case.
std::string_view only_range(std::string_view header) {
  const std::size_t equals = header.find('=');
  if (equals == header.npos || !proto::same_letters(header.substr(0, equals), "bytes")) return {};
  std::string_view only;
  for (std::string_view rest = header.substr(equals + 1); !rest.empty();) {
    const std::string_view whole = rest.substr(0, rest.find(',')), one = proto::trimmed(whole);
    rest.remove_prefix(std::min(rest.size(), whole.size() + 1));
    if (one.empty()) continue;
    if (!only.empty()) return {};
    only = one;
  }
  return only;
}

/// A strong tag that is the same; a date is none of ours, so what it says has changed (RFC 9110, 13.1.5).
bool is_still(const Request& request, const std::string& etag) {
  const auto condition = request.header("if-range");
  return !condition || (*condition == etag && !etag.starts_with("W/"));
}

}  // namespace

Wanted wanted_part(const Request& request, std::uint64_t size, const std::string& etag) {
  using What = Wanted::What;
  const std::string header = request.method == "GET" ? request.header("range").value_or("") : "";
  const std::string_view range = only_range(header);
  if (range.empty() || !is_still(request, etag)) return {};
  const std::size_t dash = range.find('-');
  if (dash == range.npos) return {};
  const std::string_view before = range.substr(0, dash), behind = range.substr(dash + 1);
  const auto first = position(before), last = position(behind);
  if (before.empty() && last) {  // so many of the end
    const std::uint64_t count = std::min(*last, size);
    return count == 0 ? Wanted{What::nothing, {}} : Wanted{What::part, {size - count, count}};
  }
  if (!first || (!behind.empty() && !last) || (last && *last < *first)) return {};
  if (*first >= size) return {What::nothing, {}};
  return {What::part, {*first, std::min(last.value_or(UINT64_MAX), size - 1) - *first + 1}};
}

std::string content_range(const ByteRange& part, std::uint64_t size) {
  return "bytes " + std::to_string(part.first) + "-" + std::to_string(part.first + part.size - 1) + "/" + std::to_string(size);
}

Response no_such_part(std::uint64_t size) {
  Response response = problem_response({"range-beyond", "the Range begins behind the last byte",
                                        "bytes within 0-" + std::to_string(size == 0 ? 0 : size - 1), "Range"});
  response.set("Accept-Ranges", "bytes");
  response.set("Content-Range", "bytes */" + std::to_string(size));
  return response;
}

Response cut_to_range(const Request& request, Response response) {
  if (response.status != 200) return response;
  const std::uint64_t size = response.bytes().size();
  const Wanted wanted = wanted_part(request, size, response.header("ETag"));
  if (wanted.what == Wanted::What::nothing) return no_such_part(size);
  if (wanted.what == Wanted::What::whole) return response;
  response.body = response.bytes().substr(wanted.part.first, wanted.part.size);
  response.shared = nullptr;
  response.status = 206;
  response.set("Content-Range", content_range(wanted.part, size));
  return response;
}

}  // namespace cordillera::server
