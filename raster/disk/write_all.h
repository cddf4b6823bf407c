#pragma once
// Bytes of a file, a pipe or a socket, however many calls they take. False: some are missing. Then errno says why, but for the
// end of what is read, which is no error.
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace cordillera::raster {

bool write_all(int descriptor, std::string_view bytes);
/// From that byte of a file on. Its own place stays.
bool write_all_at(int descriptor, std::string_view bytes, std::uint64_t first);

/// bytes: is filled.
bool read_all(int descriptor, std::span<char> bytes);
bool read_all_at(int descriptor, std::span<char> bytes, std::uint64_t first);

/// Brings a file's bytes, or a folder's names, to the disk.
bool sync_path(const std::string& path);

/// A file or folder takes the name `to`, in place of what has it, and the name is on disk. Its bytes are there before: a power
/// cut leaves the one or the other, whole. False: errno says why.
bool put_in_place(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace cordillera::raster
