#pragma once
// The words of post, watch, fetch and view, as CLI11 reads them.
#include <CLI/CLI.hpp>
#include <optional>
#include <vector>

#include "server/client/commands.h"

namespace cordillera::server::client {

class ClientWords {
 public:
  void add_to(CLI::App& app);
  /// All of them, for checks that every command gets.
  std::vector<CLI::App*> commands() const { return {post_, watch_, fetch_, view_}; }
  /// Whether one of them was asked for, and its exit code. program: path of this binary.
  std::optional<int> run(const std::string& program) const;

 private:
  void add_post(CLI::App& app);
  void add_fetch(CLI::App& app);
  void add_view(CLI::App& app);

  CLI::App *post_ = nullptr, *watch_ = nullptr, *fetch_ = nullptr, *view_ = nullptr;
  PostLine post_line_;
  WatchLine watch_line_;
  FetchLine fetch_line_;
  ViewLine view_line_;
};

}  // namespace cordillera::server::client
