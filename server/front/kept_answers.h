#pragma once
// Answers that are the same for everybody, ready for the socket: stored tiles that were asked for lately.
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "proto/lru.h"
#include "server/http/message.h"

namespace cordillera::server::front {

struct KeptAnswer {
  std::uint64_t state = 0;  ///< Response::same_while
  std::shared_ptr<const metrics::KeptCounts> counts;
  std::string etag;
  std::shared_ptr<const std::string> lines;      ///< headers of the whole answer, as they stand on the wire
  std::shared_ptr<const std::string> unchanged;  ///< headers of a 304
  std::shared_ptr<const std::string> body;
};

/// Thread-safe.
class KeptAnswers {
 public:
  /// Takes the answer to a GET of this path, if Response::same_while says that it may be given again.
  void keep(const std::string& path, const Response& response);
  /// Null: it has to be made.
  std::shared_ptr<const KeptAnswer> find(const std::string& path, std::uint64_t state);

  static constexpr std::size_t kMost_bytes = std::size_t{32} << 20;

 private:
  using Shelf = proto::Lru<std::string, std::shared_ptr<const KeptAnswer>>;
  void forget_others(std::uint64_t state);
  Shelf& shelf(const std::string& path) { return shelves_[std::hash<std::string>()(path) % shelves_.size()]; }

  std::atomic<std::uint64_t> state_{0};  ///< of the latest who asked
  // A few, so that loops seldom wait for each other.
  std::array<Shelf, 8> shelves_ = {Shelf(kMost_bytes / 8), Shelf(kMost_bytes / 8), Shelf(kMost_bytes / 8),
                                   Shelf(kMost_bytes / 8), Shelf(kMost_bytes / 8), Shelf(kMost_bytes / 8),
                                   Shelf(kMost_bytes / 8), Shelf(kMost_bytes / 8)};
};

/// Whether a kept answer may stand for what this request asks for: nothing in it but its path and If-None-Match decides.
bool takes_kept(const Request& request);

}  // namespace cordillera::server::front
