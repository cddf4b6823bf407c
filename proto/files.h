#pragma once
// Small files.
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>

namespace cordillera::proto {

/// All bytes of a file; nothing where it cannot be opened.
inline std::optional<std::string> bytes_of_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  std::ostringstream bytes;
  bytes << in.rdbuf();
  return std::move(bytes).str();
}

}  // namespace cordillera::proto
