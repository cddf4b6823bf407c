// The program. Its commands: add_commands.cpp.
#include <locale>

#include "gpu/cleap/tile_simplifier.h"
#include "raster/disk/share_folder.h"
#include "server/command_line.h"
#include "server/limits/descriptors.h"

namespace {

/// std::regex, which the HTTP library uses, asks for these tables, and libstdc++ fills them at their first use without a lock
/// (its bug 77704): to be called before the first thread.
void fill_tables_of_letters() {
  const auto& letters = std::use_facet<std::ctype<char>>(std::locale());
  const char from = 'a';
  char to = 0;
  letters.narrow(&from, &from + 1, ' ', &to);
  letters.widen(&from, &from + 1, &to);
}

}  // namespace

int main(int count, char** words) {
  using cordillera::server::CommandLine;
  fill_tables_of_letters();
  cordillera::server::limits::hold_standard_descriptors();
  cordillera::raster::fit_private_libraries();
  cordillera::server::limits::raise_descriptor_limit();  // mosaics keep many rasters open
  cordillera::gpu::cleap::offer_strategies();
  CLI::App app{"Cordillera: terrain level-of-detail tiles from digital elevation models", "cordillera"};
  app.set_version_flag("--version", std::string("cordillera ") + CORDILLERA_VERSION);
  app.require_subcommand(1);
  CommandLine commands(app);
  add_commands(commands);
  return commands.run({words + 1, words + count});
}
