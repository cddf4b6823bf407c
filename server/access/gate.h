#pragma once
// Who may do what. With tokens: reading is open, but for what is private; writing takes a token. Without: everybody who reaches
// a loopback address may do everything, pages of other sites and strangers behind a proxy apart; those read what is public.
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "proto/result.h"
#include "server/access/token_file.h"
#include "server/http/message.h"
#include "server/http/role.h"

namespace cordillera::server::access {

struct AccessSettings {
  std::string listen;
  std::string token_file;        ///< empty: none
  std::string token_lines;       ///< as the file has them
  bool insecure_writes = false;  ///< without tokens, writing from beyond this machine
};

/// Thread-safe.
class Gate {
 public:
  /// Refuses to stand open on a network: without tokens only a loopback address will do, or insecure_writes.
  static proto::Result<std::unique_ptr<Gate>> open(const AccessSettings& settings);

  bool has_tokens() const { return tokens_->configured(); }
  /// Who asks. An unknown bearer token is a problem, whatever is asked for.
  proto::Result<Identity> identify(const Request& request) const;
  /// Why the client may not do what needs the role; nothing: it may. The request's identity is that of identify().
  std::optional<proto::Problem> refuse(const Request& request, Role needed) const;
  /// Why a dataset cannot be private; nothing: it can, for there are tokens.
  std::optional<proto::Problem> refuse_private() const;

 private:
  Gate() = default;
  Identity identify_without_tokens(const Request& request) const;
  std::optional<proto::Problem> refuse_without_tokens(const Request& request) const;

  AccessSettings settings_;
  std::unique_ptr<TokenFile> tokens_;
};

/// WWW-Authenticate of the answer to such a problem (RFC 6750); empty where none belongs.
std::string challenge_of(std::string_view problem);

}  // namespace cordillera::server::access
