#include "server/front/message/target.h"

#include <algorithm>

#include "proto/letters.h"
#include "proto/numbers.h"
#include "proto/parts.h"
#include "server/access/client_address.h"
#include "server/http/percent.h"

namespace cordillera::server::front {
namespace {

std::vector<std::pair<std::string, std::string>> read_query(std::string_view text) {
  std::vector<std::pair<std::string, std::string>> query;
  proto::each_part(text, '&', [&](std::string_view pair) {
    if (pair.empty()) return;
    const auto equals = pair.find('=');
    query.emplace_back(percent_decoded(pair.substr(0, equals), AddressPart::query),
                       equals == pair.npos ? "" : percent_decoded(pair.substr(equals + 1), AddressPart::query));
  });
  return query;
}

bool begins_with_scheme(std::string_view text, std::string_view scheme) {
  return text.size() > scheme.size() && proto::same_letters(text.substr(0, scheme.size()), scheme);
}

bool is_port(std::string_view text) { return text.empty() || proto::number<std::uint16_t>(text); }

bool is_name(std::string_view text) {
  static constexpr std::string_view kOthers = "-._~!$&'()*+,;=";
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (!proto::is_letter_or_digit(text[i], kOthers) && !escape_at(text, i)) return false;
  }
  return !text.empty();
}

}  // namespace

bool is_authority(std::string_view text) {
  const bool literal = text.starts_with('[');
  const std::size_t size = std::min(text.size(), literal ? text.find(']') : text.find(':'));
  const std::string_view host = text.substr(0, size);
  std::string_view rest = text.substr(size);
  if (literal) {
    if (rest.empty() || host.find(':') == host.npos || !access::plain_address(host.substr(1))) return false;
    rest.remove_prefix(1);
  } else if (!is_name(host)) {
    return false;
  }
  return rest.empty() || (rest[0] == ':' && is_port(rest.substr(1)));
}

std::optional<Target> read_target(std::string_view text) {
  Target target;
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (!begins_with_scheme(text, scheme)) continue;
    text.remove_prefix(scheme.size());
    target.authority = text.substr(0, text.find_first_of("/?#"));
    text.remove_prefix(target.authority.size());
    if (!is_authority(target.authority)) return std::nullopt;
    if (text.empty() || text[0] != '/') target.path += '/';
  }
  text = text.substr(0, text.find('#'));
  if (target.authority.empty() && text != "*" && (text.empty() || text[0] != '/')) return std::nullopt;
  const auto mark = text.find('?');
  target.path += percent_decoded(text.substr(0, mark), AddressPart::path);
  if (mark != text.npos) target.query = read_query(text.substr(mark + 1));
  if (target.path.find('\0') != std::string::npos) return std::nullopt;
  return target;
}

}  // namespace cordillera::server::front
