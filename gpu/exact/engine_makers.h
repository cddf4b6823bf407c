#pragma once
// The engine on each device; check_call is common to both.
#include <optional>

#include "gpu/exact/simplify_block.h"

namespace cordillera::gpu::exact {

/// What is wrong with a call, if anything is.
std::optional<proto::Problem> check_call(std::span<const Block> blocks, const BlockPlan& plan);
std::optional<proto::Problem> check_call(const Ground& ground, const BlockPlan& plan);

std::unique_ptr<BlockSimplifier> make_host_engine(ParallelFor parallel);
/// Fails with a reason when the device cannot be used.
proto::Result<std::unique_ptr<BlockSimplifier>> make_cuda_engine(int device, ParallelFor parallel);

}  // namespace cordillera::gpu::exact
