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
  std::string name;  ///< of the token; empty: none was shown
};

inline const char* to_string(Role role) {
  constexpr const char* kNames[] = {"none", "read", "write", "admin"};
  return kNames[static_cast<int>(role)];
}

}  // namespace cordillera::server::access
