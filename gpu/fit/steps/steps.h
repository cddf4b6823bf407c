#pragma once
// What the steps of the driver take and give: numbers that a step finds and only later steps read, and lists of vertices.
#include <cstddef>
#include <cstdint>

#include "proto/host_device.h"

namespace cordillera::gpu::fit {

/// A number that is known, or one that stays where it was found: nobody waits for it.
struct Count {
  std::uint32_t most = 0;                ///< never more
  const std::uint32_t* found = nullptr;  ///< where steps run; null: exactly `most`

  Count() = default;
  CORDILLERA_HD Count(std::size_t exactly) : most(static_cast<std::uint32_t>(exactly)) {}
  CORDILLERA_HD Count(std::uint32_t most_, const std::uint32_t* found_) : most(most_), found(found_) {}
  CORDILLERA_HD std::uint32_t value() const { return found ? *found : most; }
};

/// Vertices: those of a list, or all below a number.
struct Vertices {
  Count count;
  const std::uint32_t* list = nullptr;
  CORDILLERA_HD std::uint32_t operator[](std::size_t i) const { return list ? list[i] : static_cast<std::uint32_t>(i); }
};

/// Vertices parted by a test.
struct Split {
  Vertices yes, no;
};

}  // namespace cordillera::gpu::fit
