#pragma once
// How often the service ended without saying so, killed or out of memory, while a dataset's job ran. Its build goes on at the
// next start; one that takes the service with it would do so for ever.
#include <filesystem>

#include "server/jobs/child.h"

namespace cordillera::server {

/// After so many, one after the other and without anything built in between, the build has failed.
inline constexpr unsigned kMostUnsaidEnds = 3;

unsigned unsaid_ends(const std::filesystem::path& folder);
void forget_unsaid_ends(const std::filesystem::path& folder);

/// The same runner. While a job runs, of which somebody is told how far it is, its folder says so. What ended while the service
/// lived, a stop included, does not count.
JobRunner noting_ends(JobRunner runner);

}  // namespace cordillera::server
