#pragma once
// Options of the table as CLI11 reads them.
#include <CLI/CLI.hpp>
#include <vector>

#include "server/options/options.h"

namespace cordillera::server {

/// Every option of the table; given gets them as the command line spelt them, in its order.
void add_table(CLI::App& command, const std::vector<OptionSpec>& table, Given& given);

}  // namespace cordillera::server
