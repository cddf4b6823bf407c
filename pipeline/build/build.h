#pragma once
// The whole way: source -> plan -> blocks -> merges -> published store.
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cordillera.pb.h"
#include "pipeline/progress/teller.h"
#include "pipeline/store/store.h"
#include "proto/result.h"
#include "raster/mosaic/mosaic.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// Follows a build from block to block.
class BlockFollower {
 public:
  virtual ~BlockFollower() = default;
  /// shown: to be called, by any thread, when other provisional tiles are shown than before. The same thread calls begin(),
  /// take() and end().
  virtual void begin(const proto::Plan& plan, std::function<void()> shown) = 0;
  /// Tiles that were asked for lately, the last first: their blocks are to be made next, and after those all that lie below tiles
  /// of level 0. Called by any thread.
  virtual std::vector<proto::TileAddress> looked_at() = 0;
  /// Whether blocks are made only under tiles that are looked at. After begin().
  virtual bool lazy() const { return false; }
  /// Whether other builds wait for this one's end. After begin().
  virtual bool others_wait() { return false; }
  /// Whether this block's tiles are shown: a process before this one may have made it. After begin().
  virtual bool shows(const proto::TileAddress& block) = 0;
  /// Whether something of this block can be looked at before it is made. After begin().
  virtual bool has_tiles(const proto::TileAddress&) { return true; }
  /// Whether somebody waits for tiles of the block's finest level. After begin(); called by any thread, as the next.
  virtual bool waits_for_finest(const proto::TileAddress&) { return false; }
  /// These are done, and the block is not. Of a block that is made again they come again.
  virtual void take_finest(const proto::TileAddress&, const std::vector<EncodedTile>&) {}
  /// A block is done, and on disk.
  virtual void take(FinishedTask&& block) = 0;
  /// All blocks are done, or the build has ended. When it returns, shown is called no more. May be called again.
  virtual void end() = 0;
};

struct BuildRequest {
  std::string raster_path;  ///< the one raster, unless there are members
  std::string raster_name;  ///< what the user called it
  raster::Trust trust = raster::Trust::operator_file;
  std::string id;                      ///< dataset id, goes into the manifest
  std::string store_path;              ///< an unfinished store of the same plan is continued
  Existing other = Existing::replace;  ///< a store of another plan at store_path
  bool old_stays = false;              ///< until the new one is finished, if it is finished itself and is to be replaced
  proto::BuildOptions options;
  std::int64_t block_samples = 0;  ///< blocks of so many samples of the finest level at most; 0: as the plan has them
  std::int32_t quarter_side = 0;   ///< > 0, for tests: all levels above blocks are made by regions of such quarters
  std::vector<raster::MosaicMember> members{};  ///< several rasters, the one that wins first
  std::shared_ptr<const raster::Decimation>
      decimation{};                   ///< read in place of the one raster's pixels: what is built is provisional
  bool at_once = false;               ///< goes into the manifest of what is provisional
  BlockFollower* follower = nullptr;  ///< outlives the build; may be null
};

/// What a build says that was told to stop.
inline const proto::Problem kCancelled{"cancelled", "the build was cancelled", "", ""};

/// Builds and publishes. Same request, same bytes, whatever threads, device, order or restarts. stop: set to leave early
/// (type "cancelled"). A lazy follower's build ends when nobody has looked at another block for a while (type "paused"), or after
/// its turn (the same, parameter "turn"). Everything committed so far is kept for the next call.
proto::Result<proto::Manifest> build(const BuildRequest& request, const ProgressCallback& progress,
                                     const std::atomic<bool>& stop);

/// The request's raster, or the mosaic of its members.
proto::Result<std::unique_ptr<raster::Source>> open_source(const BuildRequest& request);
/// What the plan's tiles are made of: the source, its samples moved to within pixels_within_m of its pixels.
std::unique_ptr<raster::Source> source_of_tiles(const proto::Plan& plan, std::unique_ptr<raster::Source> source);

/// All numbers of a build, those of keep= too: what make_plan gives, with the program and the state of what is read.
proto::Result<proto::Plan> plan_of(const BuildRequest& request, raster::Source& source);

/// Size, time of last change and options of all that is read, or a hash of them.
std::string state_of(const BuildRequest& request);

/// A raster, or the part of it inside bbox, all of whose samples are void.
proto::Problem without_data(const BuildRequest& request);

}  // namespace cordillera::pipeline
