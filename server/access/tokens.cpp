#include "server/access/tokens.h"

#include <algorithm>
#include <sstream>

#include "proto/letters.h"
#include "server/http/digest.h"

namespace cordillera::server::access {
namespace {

using proto::Problem;

constexpr const char* kPrefix = "cdl_";  // so that scanners of source code and people know one when they see it
constexpr std::size_t kSecret = 40;      // letters of 5 bits
constexpr std::size_t kMostLines = 1000;
constexpr std::size_t kMostToken = 4096;  // letters that are hashed for a stranger, once for every line
constexpr const char* kLine = "lines NAME ROLE sha256:SALT:HASH, as `cordillera token new` prints them (read, write or admin)";

bool is_hex(std::string_view text, std::size_t length) {
  return text.size() == length && text.find_first_not_of("0123456789abcdef") == text.npos;
}

/// The line without its hash: that must not get into a log.
Problem wrong(const std::string& where, std::size_t number, const std::string& what) {
  return {"tokens-invalid", where + ", line " + std::to_string(number) + ": " + what, kLine, "--tokens"};
}

proto::Result<TokenLine> read_line(const std::string& text, const std::string& where, std::size_t number) {
  std::istringstream words(text);
  std::string name, role, hash, more;
  words >> name >> role >> hash;
  if (!is_token_name(name)) return wrong(where, number, "the name is not of 1 to 64 letters, digits, dots, dashes, underscores");
  if (role_named(role) == Role::none) return wrong(where, number, "no such role");
  const auto colon = hash.find(':'), second = hash.find(':', colon + 1);
  if (words >> more || colon == hash.npos || second == hash.npos || hash.substr(0, colon) != "sha256")
    return wrong(where, number, "the third word is not sha256:SALT:HASH");
  TokenLine line{name, role_named(role), hash.substr(colon + 1, second - colon - 1), hash.substr(second + 1)};
  if (!is_hex(line.salt, 32) || !is_hex(line.hash, 64)) return wrong(where, number, "salt or hash is not of 32, 64 hex digits");
  return line;
}

}  // namespace

proto::Result<std::vector<TokenLine>> read_tokens(std::string_view text, const std::string& where) {
  std::vector<TokenLine> lines;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view whole = text.substr(0, text.find_first_of("\n;"));
    text.remove_prefix(std::min(text.size(), whole.size() + 1));
    const std::string line(whole.substr(0, whole.find('#')));
    if (line.find_first_not_of(" \t\r") == line.npos) continue;
    auto read = read_line(line, where, number);
    if (!read) return read.problem();
    lines.push_back(std::move(*read));
    if (lines.size() > kMostLines) return wrong(where, number, "more than " + std::to_string(kMostLines) + " tokens");
  }
  return lines;
}

Identity find_token(const std::vector<TokenLine>& lines, std::string_view token) {
  Identity found;
  if (token.size() > kMostToken) return found;  // the time tells its own length alone
  // Every line is looked at, whichever matches: the time tells nothing.
  for (const TokenLine& line : lines) {
    const bool same = same_secret(digest(line.salt + std::string(token)), line.hash);
    if (same) found = {line.role, line.name};
  }
  return found;
}

NewToken make_token(const std::string& name, Role role) {
  const std::string token = kPrefix + random_letters(kSecret), salt = random_hex(16);
  return {token, name + " " + to_string(role) + " sha256:" + salt + ":" + digest(salt + token)};
}

bool is_token_name(std::string_view text) {
  const auto fine = [](char c) { return proto::is_letter_or_digit(c, ".-_"); };
  return !text.empty() && text.size() <= 64 && std::all_of(text.begin(), text.end(), fine);
}

Role role_named(std::string_view text) {
  for (const Role role : {Role::read, Role::write, Role::admin}) {
    if (text == to_string(role)) return role;
  }
  return Role::none;
}

}  // namespace cordillera::server::access
