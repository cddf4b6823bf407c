#include <iostream>

#include "server/client/commands.h"
#include "server/client/events.h"
#include "server/http/dataset_id.h"

namespace cordillera::server::client {

int watch_command(const WatchLine& line) {
  if (!is_id(line.id))
    return tell(
        {"usage", "'" + line.id + "' is no dataset's id", "an id that post printed, or that GET /v1/datasets lists", "id"},
        line.show);
  const auto place = find_service(line.place);
  if (!place) return tell(place.problem(), line.show);
  Talk talk(*place, line.words);
  ProgressBar bar(ProgressBar::style_of(line.words == Verbosity::all));
  const auto ready = follow(talk, line.id, bar);
  if (!ready) return tell(ready.problem(), line.show);
  if (line.show == Show::json) {
    std::cout << ready->dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
  } else if (line.words == Verbosity::all) {
    std::cout << how_it_stands(*ready) << std::endl;
  }
  return kDone;
}

}  // namespace cordillera::server::client
