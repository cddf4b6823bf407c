#pragma once
// Bearer tokens. What is kept is a line with a salted SHA-256 of each: a token has 200 random bits, so that nobody can try them
// all and a slow hash would only slow the service down.
#include <string>
#include <string_view>
#include <vector>

#include "proto/result.h"
#include "server/http/role.h"

namespace cordillera::server::access {

struct TokenLine {
  std::string name;
  Role role = Role::none;
  std::string salt;  ///< hex
  std::string hash;  ///< hex, of salt and token
};

/// Lines `NAME ROLE sha256:SALT:HASH`, ended by a newline or a semicolon; # starts a comment. Several lines may have one name:
/// that is how a token is changed without a gap. where: what problems call the text.
proto::Result<std::vector<TokenLine>> read_tokens(std::string_view text, const std::string& where);

/// Whose token it is. Role::none: it is nobody's, or longer than 4 KiB and not looked for. Takes as long for a wrong
/// token as for a right one of its length.
Identity find_token(const std::vector<TokenLine>& lines, std::string_view token);

struct NewToken {
  std::string token;  ///< to be shown once
  std::string line;   ///< to be kept, without the newline
};
NewToken make_token(const std::string& name, Role role);

/// Letters, digits, dot, dash and underscore, 1 to 64 of them: a name stands in logs.
bool is_token_name(std::string_view text);
/// read, write or admin; Role::none for anything else.
Role role_named(std::string_view text);

}  // namespace cordillera::server::access
