#pragma once
// A job whose rasters come as they are read asks its service for pieces of it, over a descriptor that it inherits: it has no
// network, and its service knows no formats.
#include <atomic>
#include <optional>
#include <span>
#include <thread>

#include "proto/result.h"
#include "raster/disk/descriptor.h"
#include "raster/storage/ranged_file.h"

namespace cordillera::server::updates {

class RangedSources;

/// The descriptor on which a job asks. Nothing is there where its rasters are.
inline constexpr int kAskDescriptor = 4;

/// The job's side. Whether it may ask.
bool may_ask();
/// Returns when the pieces are in the file of that number. Where they do not come the process ends at once: what was read without
/// them would be wrong, and GDAL does without much of what it cannot read. The service knows why.
void ask_for(std::size_t file, std::span<const raster::ByteRange> ranges);

/// The service's side: a thread that answers while it lives. What a job asks for is looked at: it may have been taken over.
class RangeAnswers {
 public:
  RangeAnswers() = default;
  ~RangeAnswers() { end(); }
  RangeAnswers(const RangeAnswers&) = delete;
  RangeAnswers& operator=(const RangeAnswers&) = delete;

  /// The descriptor that the job is to inherit. None: the system had none.
  raster::Descriptor open();
  /// sources: outlive this object. stop: as of the job.
  void begin(RangedSources& sources, const std::atomic<bool>& stop);
  void end();
  /// After the end: why a piece did not come.
  const std::optional<proto::Problem>& problem() const { return problem_; }

 private:
  void answer(RangedSources& sources, const std::atomic<bool>& stop);
  raster::Descriptor ours_;
  std::atomic<bool> ending_{false};
  std::optional<proto::Problem> problem_;
  std::thread thread_;
};

}  // namespace cordillera::server::updates
