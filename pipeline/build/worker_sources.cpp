#include "pipeline/build/worker_sources.h"

#include <system_error>
#include <utility>

namespace cordillera::pipeline {

void WorkerSources::add(proto::Result<std::unique_ptr<raster::Source>> source) {
  const std::lock_guard lock(mutex_);
  if (source.ok())
    sources_.push_back(std::move(*source));
  else
    problem_ = source.problem();
  changed_.notify_all();
}

proto::Result<void> WorkerSources::open(unsigned workers, const Open& open) {
  add(open());
  if (problem_) return *problem_;
  const auto open_others = [this, workers, open] {
    try {
      for (unsigned k = 1; k < workers && !closing_ && !problem_; ++k) add(open());
    } catch (...) {
      const std::lock_guard lock(mutex_);
      thrown_ = std::current_exception();
      changed_.notify_all();
    }
  };
  try {
    opening_ = std::async(std::launch::async, open_others);
  } catch (const std::system_error&) { open_others(); }  // the system has no thread more
  return {};
}

proto::Result<raster::Source*> WorkerSources::of(unsigned worker) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return sources_.size() > worker || problem_ || thrown_; });
  if (sources_.size() > worker) return sources_[worker].get();
  if (thrown_) std::rethrow_exception(thrown_);
  return *problem_;
}

}  // namespace cordillera::pipeline
