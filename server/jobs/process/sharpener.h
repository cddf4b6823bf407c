#pragma once
// Provisional tiles that become final ones block by block, while a job builds.
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "pipeline/build/build.h"

namespace cordillera::server {

/// Puts blocks that are done into the provisional store of a job's folder, from time to time: a new file beside it takes its name
/// when it is whole, as every step of provisional tiles does. A thread of its own does it, for a tenth of the build's time at
/// most; of a lazy build's blocks that somebody looks at as soon as it can. Without a provisional store, where blocks cannot
/// stand in it, and without room on the disk nothing happens. What goes wrong is logged, and no problem of the build. Tiles of a
/// block's finest level for which somebody waits stand in a store of their own until the block has been shown for a step.
class Sharpener final : public pipeline::BlockFollower {
 public:
  enum class Blocks { all, looked_at };
  Sharpener(std::filesystem::path folder, Blocks blocks) : folder_(std::move(folder)), blocks_(blocks) {}
  ~Sharpener() override { end(); }
  void begin(const proto::Plan& plan, std::function<void()> shown) override;
  std::vector<proto::TileAddress> looked_at() override;
  /// Where blocks cannot be shown one by one, all are made.
  bool others_wait() override;
  bool lazy() const override { return blocks_ == Blocks::looked_at && can_show_; }
  bool shows(const proto::TileAddress& block) override;
  bool has_tiles(const proto::TileAddress& block) override { return with_tiles_.empty() || with_tiles_.contains(block); }
  bool waits_for_finest(const proto::TileAddress& block) override;
  void take_finest(const proto::TileAddress& block, const std::vector<pipeline::EncodedTile>& tiles) override;
  void take(pipeline::FinishedTask&& block) override;
  void end() override;

 private:
  using Clock = std::chrono::steady_clock;
  using Took = std::optional<Clock::duration>;  ///< of processor time; none: it failed
  void run();
  bool somebody_waits();
  Clock::time_point due_at() const;
  Took make_step(const std::vector<pipeline::FinishedTask>& blocks) const;
  void forget_finest(const std::set<proto::TileAddress>& blocks) const;

  const std::filesystem::path folder_;
  const Blocks blocks_;
  proto::Plan plan_;
  bool can_show_ = false;
  std::set<proto::TileAddress> with_tiles_;  ///< blocks that have provisional tiles; of a lazy build
  std::function<void()> shown_;
  std::thread thread_;
  std::mutex mutex_;  // of all that follows
  std::set<proto::TileAddress> shown_blocks_;
  std::condition_variable changed_;
  Clock::time_point started_{}, step_began_{};
  Clock::duration step_took_{};
  std::vector<pipeline::FinishedTask> waiting_;
  bool somebody_waits_ = false;  ///< for one of these
  bool ending_ = false;
};

}  // namespace cordillera::server
