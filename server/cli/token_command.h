#pragma once
// cordillera token.
#include <string>

namespace cordillera::server {

struct TokenWords {
  std::string action;  ///< new
  std::string name;
  std::string role;
  std::string file;  ///< where the line is added; empty: it is printed
};
int token_command(const TokenWords& words);

}  // namespace cordillera::server
