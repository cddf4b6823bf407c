#pragma once
// Keys of a plan's tasks: hashes of all that their results depend on.
#include <map>
#include <span>
#include <string>
#include <vector>

#include "proto/lattice.h"
#include "raster/source.h"
#include "work.pb.h"

namespace cordillera::pipeline::work {

using Keys = std::map<proto::TileAddress, std::string>;

/// What is common to all tasks of a plan, and what each has of its own. The plan's numbers, rasters and options are set, and
/// outlive this.
class TaskKeys {
 public:
  explicit TaskKeys(const proto::WorkPlan& plan);

  /// window: of the samples that it reads. sources: indices of rasters, ascending.
  std::string block(const proto::TileAddress& node, const raster::Source::Window& window,
                    std::span<const std::uint32_t> sources) const;
  /// Of all levels above the blocks. below: keys of these.
  std::string above(const Keys& below) const;

 private:
  std::string common_, numbers_;
  std::map<int, std::string> levels_;  ///< numbers of the finest level down to this one
  std::vector<std::string> sources_;
  std::vector<std::size_t> sheets_;  ///< of the rasters, where they are blended
};

}  // namespace cordillera::pipeline::work
