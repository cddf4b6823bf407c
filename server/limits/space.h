#pragma once
// Room on the data disk for rasters that arrive, shared by every way in: what is announced is set aside before its first byte,
// what is not is set aside in steps as it comes.
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "server/limits/disk.h"

namespace cordillera::server::limits {

/// Thread-safe.
class Space {
 public:
  using Look = std::function<std::optional<DiskSpace>()>;
  /// look: at the disk as it is now; nothing where it cannot be asked, then nothing is refused.
  Space(Look look, std::uint32_t free_percent) : look_(std::move(look)), free_percent_(free_percent) {}

  /// Removes what can be made again until about so many bytes are free; false: there is nothing more of it. Called where there is
  /// no room, by any thread, one at a time; it must not ask this for room.
  using Spare = std::function<bool(std::uint64_t bytes)>;
  /// Null: nothing is removed.
  void set_spare(Spare spare);

  /// What one raster may still write. One thread's; gives back what is left of it when it goes.
  class Claim {
   public:
    ~Claim();
    Claim(const Claim&) = delete;
    Claim& operator=(const Claim&) = delete;
    /// Before so many more bytes are written; those before them are in the file by now. Empty: there is room; else why there is
    /// none.
    std::string next(std::uint64_t bytes);

   private:
    friend class Space;
    Claim(Space& space, bool may_remove) : space_(space), may_remove_(may_remove) {}
    Space& space_;
    const bool may_remove_;
    std::uint64_t left_ = 0;   ///< set aside for it
    std::uint64_t last_ = 0;   ///< of these, on their way into the file
    std::uint64_t since_ = 0;  ///< written since the disk was looked at
  };
  /// Sets bytes aside; none in result where there is no room for them, and why then says so. bytes: 0 if the size is not known.
  std::unique_ptr<Claim> claim(std::uint64_t bytes, std::string* why) { return claim(bytes, why, true); }
  /// The same for what can be made again itself: nothing is removed for it.
  std::unique_ptr<Claim> claim_for_spare(std::uint64_t bytes, std::string* why) { return claim(bytes, why, false); }

  /// "The disk is full" in a sentence, where so many bytes have no room beside all that is set aside; empty: they have, or it
  /// cannot be asked.
  std::string full(std::uint64_t bytes) const;

 private:
  std::unique_ptr<Claim> claim(std::uint64_t bytes, std::string* why, bool may_remove);
  std::string full_beside(std::uint64_t bytes, std::uint64_t aside, bool may_remove) const;
  std::string grow(Claim& claim, std::uint64_t bytes);

  const Look look_;
  const std::uint32_t free_percent_;
  Spare spare_;
  mutable std::mutex mutex_;
  std::uint64_t aside_ = 0;  ///< of all claims together
};

}  // namespace cordillera::server::limits
