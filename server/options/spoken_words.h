#pragma once
// What people type from habit, said as this program's command line has it. A function of the words alone.
#include <string>
#include <vector>

namespace cordillera::server {

/// Without the program's name: `help` and `help build` are --help, `version` and -v are --version, and the four numbers of `--bbox 10 46 11 47` are
/// one word.
std::vector<std::string> understood(std::vector<std::string> words);

/// "HOST:PORT" of --host and --port; what is empty is that of the default. An IPv6 address gets its brackets.
std::string listen_address(const std::string& host, const std::string& port);

}  // namespace cordillera::server
