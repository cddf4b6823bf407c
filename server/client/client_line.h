#pragma once
// The words of post, watch and fetch, as CLI11 reads them.
#include <CLI/CLI.hpp>
#include <optional>
#include <vector>

#include "server/client/commands.h"

namespace cordillera::server::client {

class ClientWords {
 public:
  void add_to(CLI::App& app);
  /// All three, for checks that every command gets.
  std::vector<CLI::App*> commands() const { return {post_, watch_, fetch_}; }
  /// Whether one of them was asked for, and its exit code.
  std::optional<int> run() const;

 private:
  void add_post(CLI::App& app);
  void add_fetch(CLI::App& app);

  CLI::App *post_ = nullptr, *watch_ = nullptr, *fetch_ = nullptr;
  PostLine post_line_;
  WatchLine watch_line_;
  FetchLine fetch_line_;
};

}  // namespace cordillera::server::client
