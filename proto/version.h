#pragma once
namespace cordillera::proto {
/// Goes into plans and manifests: an unfinished store of another program version is started anew.
inline constexpr const char* kProgram = "cordillera 0.1.0";
}  // namespace cordillera::proto
