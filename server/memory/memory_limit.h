#pragma once
// What memory= means: how much private memory (heap, stacks, caches) the process of a build may take on top of the program
// itself.
#include <string>

#include "cordillera.pb.h"
#include "proto/result.h"

namespace cordillera::server {

/// One thread needs room for its stack, its tile and its share of the caches: no more threads than fit. The least that memory=
/// may be, too: with less even a build of 100 x 100 pixels ends in its middle.
inline constexpr std::uint32_t kMemoryPerThread_mib = 96;

/// memory() of a posted build that asks for nothing: enough for all its threads.
std::uint32_t default_memory_mib(const proto::BuildOptions& options);

/// Whether a build with these options may talk to a GPU: there is a driver, and nobody asked for the CPU.
bool may_use_cuda(const proto::BuildOptions& options);

/// Limits this process to memory() MiB and threads() to what fits in it; 0 limits nothing. Stacks of new threads have 2 MiB. For
/// the rest of the process's life: the process is the build's. A build that may talk to a GPU keeps its address space (the driver
/// reserves far more than it uses) and only gives up threads.
void limit_memory(proto::BuildOptions& options);

/// Whether not even 8 MiB are to be had: what fails then fails for want of memory, whatever a library says of it.
bool memory_is_short();

/// raster: what the user called it.
proto::Problem out_of_memory(const proto::BuildOptions& options, const std::string& raster);

/// When memory runs out, writes the words to the descriptor and ends the process with exit code 1. There is nothing to go on
/// with: an exception in mid-work would need memory itself. Keeps the words.
void on_out_of_memory(int descriptor, const std::string& words);

}  // namespace cordillera::server
