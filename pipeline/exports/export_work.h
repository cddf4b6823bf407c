#pragma once
// How an export is made, and how far it has come.
#include <cstdint>
#include <utility>

#include "pipeline/exports/whole_file.h"
#include "pipeline/progress/teller.h"

namespace cordillera::pipeline::exports {

struct ExportWork {
  ExportWork(unsigned with_threads = 1, ProgressCallback told = {}) : threads(with_threads), progress(std::move(told)) {}
  unsigned threads;           ///< that make tiles; 0: one for each usable core
  ProgressCallback progress;  ///< called by the caller's thread, a few times a second; may be empty
};

/// The stage "export", which counts paths or tiles.
class ExportProgress {
 public:
  /// callback: outlives the object; may be empty.
  explicit ExportProgress(const ProgressCallback& callback) : told_(callback != nullptr), teller_(callback) {
    if (told_) teller_.stage(kStage, 0);
  }
  /// list(one): calls one for each that is to be expected. It is not called where nobody is told: to count takes a while.
  template <class List>
  void expect(const faces::Terrain& terrain, const List& list) {
    if (!told_) return;
    total_ = done_ = 0;
    list([&] {
      if (terrain.is_stopped()) throw Refused{kStopped};
      ++total_;
    });
    teller_.stage(kStage, static_cast<double>(total_));
  }
  void next() {
    if (told_ && done_ < total_) teller_.tell(static_cast<double>(++done_));
  }
  /// All are done: fewer than were expected, where some show nothing.
  void finish() {
    if (told_ && done_ < total_) teller_.tell(static_cast<double>(total_));
  }

 private:
  static constexpr const char* kStage = "export";
  bool told_;
  Teller teller_;
  std::uint64_t total_ = 0, done_ = 0;
};

}  // namespace cordillera::pipeline::exports
