#pragma once
// Server-sent events, as the HTML standard has them, and a dataset's that are followed to the last one.
#include <functional>
#include <string>
#include <string_view>

#include "server/cli/progress_bar.h"
#include "server/client/talk.h"

namespace cordillera::server::client {

struct Event {
  std::string name;  ///< "message" unless the stream names another
  std::string data;  ///< lines joined by newlines
};

/// Puts events together from pieces of a stream, wherever these are cut.
class EventReader {
 public:
  /// take: false ends it, and what is left of the piece is dropped. Gives what take said last.
  bool feed(std::string_view piece, const std::function<bool(const Event&)>& take);

 private:
  void line(std::string_view text);

  std::string rest_;  ///< of a line
  Event event_;
  bool has_data_ = false;
};

/// Until it is ready, whatever breaks on the way: its last status. A problem: the build failed, or the service cannot be asked.
/// Or, of a lazy build, until there is something to see.
proto::Result<Json> follow(Talk& talk, const std::string& id, ProgressBar& bar);

/// What is said of a dataset that was followed: "ID is ready".
std::string how_it_stands(const Json& status);

}  // namespace cordillera::server::client
