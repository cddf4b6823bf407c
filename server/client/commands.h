#pragma once
// cordillera post, watch, fetch and view: a service from the command line. Each returns the exit code: 0 done, 1 refused or
// failed, 2 wrong usage, 75 trying again may help.
#include <functional>
#include <string>
#include <vector>

#include "server/cli/commands.h"
#include "server/client/service_address.h"
#include "server/options/options.h"

namespace cordillera::server::client {

enum class After { leave, wait };

struct PostLine {
  ServiceWords place;
  std::vector<std::string> rasters;  ///< several: the one that wins where they overlap first
  Given options;                     ///< of the table, as the command line spells them
  bool in_parts = false;             ///< whatever their size
  bool updates = false;              ///< other rasters may be added later
  After after = After::leave;
  Show show = Show::table;
  Verbosity words = Verbosity::all;
  std::function<void()> accepted;  ///< called when the service has the dataset, before any wait; may be empty
};
int post_command(const PostLine& line);

struct WatchLine {
  ServiceWords place;
  std::string id;
  Show show = Show::table;
  Verbosity words = Verbosity::all;
};
int watch_command(const WatchLine& line);

struct FetchLine {
  ServiceWords place;
  std::string id;
  std::vector<std::string> what;  ///< "10/617/763.drc", "manifest", "tileset" or any address below the dataset's
  std::string bbox, level;        ///< tiles of a box and of levels, as given
  std::string format = "drc";     ///< of these tiles
  bool middle = false;            ///< one tile, where the data is
  std::string output;             ///< a file, or a folder; empty: standard output
  std::string connections = "4";
  Show show = Show::table;
  Verbosity words = Verbosity::all;
};
int fetch_command(const FetchLine& line);

enum class Browser { opens, stays_shut };

struct ViewLine {
  std::vector<std::string> paths;  ///< rasters, .sqlite files, folders that build wrote, archives
  std::string port;                ///< empty: any that is free
  Given options;                   ///< of the rasters' builds, as the command line spells them
  Browser browser = Browser::opens;
};
/// cordillera view: the viewer with what the paths name, until a signal. program: path of this binary.
int view_command(const ViewLine& line, const std::string& program);

}  // namespace cordillera::server::client
