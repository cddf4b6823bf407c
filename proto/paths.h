#pragma once
// What two paths have to do with each other.
#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>

namespace cordillera::proto {

/// Whether `inner` is `outer` or something below it. By their names alone: both are absolute, without links and dots.
inline bool lies_in(const std::filesystem::path& inner, const std::filesystem::path& outer) {
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

/// "out/" and "out" are one place.
inline std::filesystem::path place_of(const std::filesystem::path& path) {
  const std::filesystem::path place = std::filesystem::absolute(path).lexically_normal();
  return place.has_filename() ? place : place.parent_path();
}

/// Where a file lies that is to be replaced: a link to it goes on pointing there. error: of a link that leads nowhere; then
/// empty.
inline std::filesystem::path behind_link(const std::filesystem::path& path, std::error_code& error) {
  return std::filesystem::is_symlink(path, error) ? std::filesystem::canonical(path, error) : path;
}

/// What a library said of a path, under the name by which others know it.
inline std::string without_path(std::string text, const std::string& path, const std::string& name) {
  for (std::size_t at = text.find(path); !path.empty() && at != std::string::npos; at = text.find(path, at + name.size()))
    text.replace(at, path.size(), name);
  return text;
}

}  // namespace cordillera::proto
