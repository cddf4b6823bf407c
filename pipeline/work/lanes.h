#pragma once
// Tasks side by side: small blocks have too few tiles to keep all threads busy within one.
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "pipeline/build.h"
#include "pipeline/builder.h"
#include "pipeline/workers.h"

namespace cordillera::pipeline::work {

/// One builder that has all threads where blocks are large or a GPU wants batches, else one a thread.
class Lanes {
 public:
  static proto::Result<std::unique_ptr<Lanes>> open(const BuildRequest& request, const proto::Plan& plan,
                                                    const std::atomic<bool>& stop);

  /// Does tasks 0 .. count - 1 in any order; the first problem ends it.
  using Task = std::function<proto::Result<void>(Builder& builder, std::size_t task)>;
  proto::Result<void> each(std::size_t count, const Task& task);

 private:
  struct Lane {
    Workers workers;
    Builder builder;
    Lane(unsigned threads, const BuildRequest& request, const proto::Plan& plan, const std::atomic<bool>& stop)
        : workers(threads),
          builder(
              plan, workers, [&request] { return open_source(request); }, request.options.device(), stop) {}
  };
  explicit Lanes(const std::atomic<bool>& stop) : stop_(stop) {}

  const std::atomic<bool>& stop_;
  std::vector<std::unique_ptr<Lane>> lanes_;
  std::unique_ptr<Workers> crew_;  ///< a thread a lane
};

}  // namespace cordillera::pipeline::work
