#pragma once
// Provisional tiles that become final ones block by block, while a job builds.
#include <chrono>
#include <filesystem>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/build/build.h"

namespace cordillera::server {

/// Puts blocks that are done into the provisional store of a job's folder, from time to time: a new file beside it takes its name when it is whole, as
/// every step of provisional tiles does. It costs a tenth of the build's time at most. Without a provisional store, and where blocks cannot stand in
/// it, nothing happens. What goes wrong is logged, and no problem of the build.
class Sharpener final : public pipeline::BlockFollower {
 public:
  explicit Sharpener(std::filesystem::path folder) : folder_(std::move(folder)) {}
  ~Sharpener() override;
  std::vector<proto::TileAddress> looked_at() override;
  bool take(const proto::Plan& plan, pipeline::FinishedTask&& block) override;
  bool end() override;

 private:
  using Clock = std::chrono::steady_clock;
  bool can_show(const proto::Plan& plan);
  bool is_due() const;
  void begin();
  bool has_ended();
  using Took = std::optional<Clock::duration>;  ///< none: it failed
  Took make_step(const std::vector<pipeline::FinishedTask>& blocks) const;

  const std::filesystem::path folder_;
  const Clock::time_point started_ = Clock::now();
  Clock::time_point step_began_ = started_;
  Clock::duration step_took_{};
  enum class Use { unknown, yes, no } use_ = Use::unknown;
  proto::Plan plan_;
  std::vector<pipeline::FinishedTask> waiting_;
  bool somebody_waits_ = false;  ///< for one of these
  std::future<Took> under_way_;
};

}  // namespace cordillera::server
