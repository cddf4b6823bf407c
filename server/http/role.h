#pragma once
// Who somebody is, as far as the service asks.
#include <string>

namespace cordillera::server::access {

/// Each may all that those before it may.
enum class Role {
  none,   ///< reads what is public
  read,   ///< reads everything, metrics too
  write,  ///< posts, and removes what it has posted
  admin,  ///< removes everything
};

struct Identity {
  Role role = Role::none;
  std::string name;          ///< of the token; empty: none was shown
  bool from_beyond = false;  ///< without tokens: not this machine, whatever it may do by --insecure-writes

  bool reads_private() const { return role >= Role::read && !from_beyond; }
};

inline const char* to_string(Role role) {
  constexpr const char* kNames[] = {"none", "read", "write", "admin"};
  return kNames[static_cast<int>(role)];
}

}  // namespace cordillera::server::access
