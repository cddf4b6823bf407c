#pragma once
// The API's description, as the server gives it.
#include <set>
#include <string>

#include "fixture.h"

namespace cordillera::server {

using Words = std::set<std::string>;

inline Json description() {
  TestService test;
  return body_of(test.get("/api"));
}

}  // namespace cordillera::server
