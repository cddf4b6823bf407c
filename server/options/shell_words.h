#pragma once
// What a shell and `man` are told of the command line: made of its commands and options as CLI11 has them, which come from the
// option table.
#include <CLI/CLI.hpp>
#include <string>

#include "proto/result.h"

namespace cordillera::server {

/// A script for bash, zsh or fish, to be sourced or put where the shell looks for completions.
proto::Result<std::string> completions(const CLI::App& app, const std::string& shell);
/// cordillera(1), as troff.
std::string man_page(const CLI::App& app);

}  // namespace cordillera::server
