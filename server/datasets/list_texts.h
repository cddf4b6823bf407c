#pragma once
// What the list of datasets says of those that do not change any more, kept as text.
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "server/datasets/library.h"
#include "server/datasets/registry.h"

namespace cordillera::server {

/// Thread-safe.
class ListTexts {
 public:
  using Make = std::function<std::string()>;
  /// What an item of the list is made from.
  struct Subject {
    const Row& row;
    const std::shared_ptr<const Summary>& summary;
    const std::string& path;  ///< as the client sees it
  };
  /// make() unless it is known of just this.
  std::string of(const Subject& subject, const Make& make);
  void forget(const std::string& id);

 private:
  struct Known {
    Row row;
    std::shared_ptr<const Summary> summary;
    std::string path;
    std::shared_ptr<const std::string> text;
  };
  std::mutex mutex_;
  std::unordered_map<std::string, Known> known_;
};

}  // namespace cordillera::server
