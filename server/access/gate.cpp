#include "server/access/gate.h"

#include <algorithm>
#include <array>

#include "proto/letters.h"
#include "server/access/client_address.h"

namespace cordillera::server::access {
namespace {

using proto::Problem;

constexpr const char* kHeader = "a header Authorization: Bearer TOKEN, with a token that the operator gave you";

/// "Bearer abc" -> abc. Other schemes are for a proxy before us.
std::optional<std::string> bearer_of(const Request& request) {
  const auto header = request.header("authorization");
  if (!header || header->size() < 7) return std::nullopt;
  return proto::same_letters(header->substr(0, 7), "bearer ") ? std::optional(header->substr(7)) : std::nullopt;
}

/// "https://host:port" -> "host:port".
std::string authority_of(const std::string& origin) {
  const auto slashes = origin.find("://");
  return slashes == origin.npos ? "" : origin.substr(slashes + 3);
}

/// A page of another site: browsers send its requests without asking as long as they look like a form's.
bool from_another_site(const Request& request) {
  const auto origin = request.header("origin");
  if (!origin) {
    // Another port of this machine is the same site, and another's page all the same.
    const std::string site = request.header("sec-fetch-site").value_or("");
    return site == "cross-site" || site == "same-site";
  }
  const std::string authority = authority_of(*origin);
  return authority.empty() || (authority != request.header("host") && authority != request.header("x-forwarded-host"));
}

/// What proxies add, each some of it. A page cannot leave them out, and who is on this machine has no reason to write them.
bool came_through_a_proxy(const Request& request) {
  constexpr std::array<std::string_view, 13> kHeaders = {"forwarded",
                                                         "via",
                                                         "x-real-ip",
                                                         "x-client-ip",
                                                         "client-ip",
                                                         "true-client-ip",
                                                         "cf-connecting-ip",
                                                         "cf-connecting-ipv6",
                                                         "cdn-loop",
                                                         "x-cluster-client-ip",
                                                         "x-envoy-external-address",
                                                         "fastly-client-ip",
                                                         "fly-client-ip"};
  return std::ranges::any_of(request.headers, [&](const auto& header) {
    const std::string_view name = header.first;
    return name.starts_with("x-forwarded") || name.starts_with("x-original-") ||
           std::ranges::find(kHeaders, name) != kHeaders.end();
  });
}

/// A name that a stranger points at 127.0.0.1 makes his page one of ours, as browsers see it. And what a proxy hands on comes
/// from everywhere.
bool came_from_beyond(const Request& request) {
  const auto host = request.header("host");
  return (host && !is_loopback(host_of(*host))) || came_through_a_proxy(request);
}

Problem too_low(const Identity& who, Role needed) {
  return {"role-too-low",
          "the token '" + who.name + "' has the role " + to_string(who.role) + "; this takes " + to_string(needed),
          std::string("a token with the role ") + to_string(needed), "Authorization"};
}

}  // namespace

proto::Result<std::unique_ptr<Gate>> Gate::open(const AccessSettings& settings) {
  std::unique_ptr<Gate> gate(new Gate);
  gate->settings_ = settings;
  auto tokens = TokenFile::open(settings.token_file, settings.token_lines);
  if (!tokens) return tokens.problem();
  gate->tokens_ = std::move(*tokens);
  if (gate->has_tokens() && settings.insecure_writes) {
    return Problem{"options-conflict", "--insecure-writes lets everybody write, and there are tokens that say who may",
                   "one of them", "--insecure-writes"};
  }
  if (!gate->has_tokens() && !settings.insecure_writes && !is_loopback(host_of(settings.listen))) {
    return Problem{
        "listen-unprotected", "on " + settings.listen + " everybody on the network could post and delete: there are no tokens",
        "--tokens FILE with lines of `cordillera token new`, an address of this machine alone such as 127.0.0.1:8080, or "
        "--insecure-writes where everybody may write",
        "--listen"};
  }
  return gate;
}

proto::Result<Identity> Gate::identify(const Request& request) const {
  if (!has_tokens()) return identify_without_tokens(request);
  const auto token = bearer_of(request);
  if (!token) return Identity{};
  Identity found = tokens_->find(*token);
  if (found.role != Role::none) return found;
  return Problem{"token-invalid", "the token is not, or no longer, one of this service", kHeader, "Authorization"};
}

/// Who may not write by being here reads nothing private either: what was posted while there were tokens stays closed.
Identity Gate::identify_without_tokens(const Request& request) const {
  Identity who;
  if (!refuse_without_tokens(request)) who.role = Role::admin;
  // Only with --insecure-writes do others reach the port at all.
  const bool here = is_loopback(host_of(settings_.listen)) || is_loopback(request.client);
  who.from_beyond = !here || came_from_beyond(request);
  return who;
}

std::optional<Problem> Gate::refuse(const Request& request, Role needed) const {
  if (needed == Role::none) return std::nullopt;
  if (!has_tokens()) return needed == Role::read ? std::nullopt : refuse_without_tokens(request);
  if (request.who.role >= needed) return std::nullopt;
  if (request.who.role != Role::none) return too_low(request.who, needed);
  return Problem{"token-missing", "this takes a token", kHeader, "Authorization"};
}

std::optional<Problem> Gate::refuse_private() const {
  if (has_tokens()) return std::nullopt;
  return Problem{"option-forbidden", "private: this service was started without tokens, by which readers are told apart",
                 "private=0, or cordillera serve --tokens FILE", "private"};
}

std::optional<Problem> Gate::refuse_without_tokens(const Request& request) const {
  if (from_another_site(request)) {
    return Problem{"origin-forbidden", "a page of another site may not write here",
                   "a page of this service, or a program that is no browser", "Origin"};
  }
  if (settings_.insecure_writes || !came_from_beyond(request)) return std::nullopt;
  return Problem{"token-missing", "writing from beyond this machine takes a token, and this service was started without any",
                 "cordillera serve --tokens FILE, or --insecure-writes where everybody may write", "Authorization"};
}

std::string challenge_of(std::string_view problem) {
  const std::string bearer = "Bearer realm=\"cordillera\"";
  if (problem == "token-missing") return bearer;
  if (problem == "token-invalid") return bearer + ", error=\"invalid_token\"";
  return problem == "role-too-low" ? bearer + ", error=\"insufficient_scope\"" : "";
}

}  // namespace cordillera::server::access
