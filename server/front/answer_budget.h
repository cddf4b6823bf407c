#pragma once
// Memory of answers that clients have yet to read.
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace cordillera::server::front {

/// What several connections send together counts once, in all and for each client. Thread-safe. Must outlive what it gives.
class AnswerBudget {
 public:
  using Share = std::shared_ptr<void>;
  using Bytes = std::shared_ptr<const std::string>;

  AnswerBudget(std::size_t most, std::size_t most_per_client) : most_(most), most_per_client_(most_per_client) {}

  /// Room for the bytes, until the share goes. Null: there is none. Who has none yet gets it, however large, so that no bound
  /// shuts an answer out for good.
  Share take(const std::string& client, const Bytes& bytes);
  /// Whether nothing more would be let in for this client.
  bool full(const std::string& client) const;
  std::size_t all() const;

 private:
  struct Used {
    std::size_t bytes = 0;
    std::map<const std::string*, std::size_t> holders;

    bool has_room(const Bytes& wanted, std::size_t most) const;
    void add(const Bytes& more);
    void remove(const Bytes& less);
  };
  void give_back(const std::string& client, const Bytes& bytes);

  const std::size_t most_, most_per_client_;
  mutable std::mutex mutex_;
  Used all_;
  std::map<std::string, Used> clients_;
};

}  // namespace cordillera::server::front
