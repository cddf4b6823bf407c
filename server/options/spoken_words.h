#pragma once
// What people type from habit, said as this program's command line has it. A function of the words alone.
#include <optional>
#include <string>
#include <vector>

namespace cordillera::server {

/// Without the program's name: `help` and `help build` are --help (with --all --help-all), `version` and -v are --version, and
/// the four numbers of `--bbox 10 46 11 47` are one word. `--` goes: what follows is no option, so that "-a.tif" is "./-a.tif".
std::vector<std::string> understood(std::vector<std::string> words);

/// The option that other programs call so: "--t_srs" and "epsg" are "crs", "units" is "z-scale". None: nobody is known to.
std::optional<std::string> meant_by_habit(std::string word);

/// A sentence whose options are spelt as over HTTP, said to somebody at a command line: "z_scale= for another unit" is "--z-scale
/// for another unit", "nodata=-9999" is "--nodata=-9999". Options of building, posting and meshes; other words are left.
std::string as_typed(const std::string& sentence);

/// "HOST:PORT" of --host and --port; what is empty is that of the default. An IPv6 address gets its brackets.
std::string listen_address(const std::string& host, const std::string& port);

}  // namespace cordillera::server
