#pragma once
// Files wherever GDAL reaches: a path of this machine, or /vsis3/…, /vsigs/…, /vsiaz/… for object storage. Addresses and keys of
// object storage come from GDAL's own options and environment variables (AWS_S3_ENDPOINT and so on).
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/result.h"

namespace cordillera::raster {

/// One of GDAL's file systems, not a folder of this machine.
bool is_remote(const std::string& path);

/// The file appears whole under its name or not at all, whoever writes it at the same time: here by a synced file and a rename,
/// in object storage by the end of its upload. Folders on the way are made. "storage-write" when it fails.
proto::Result<void> write_whole(const std::string& path, const std::string& bytes);

/// A file of this machine under a name elsewhere, in one upload: whole or not at all. "storage-write" when it fails.
proto::Result<void> upload_file(const std::string& local, const std::string& path);

/// Bytes from offset on, fewer at the file's end; nullopt when there is no such file. "storage-read" when it fails otherwise.
proto::Result<std::optional<std::string>> read_range(const std::string& path, std::uint64_t offset, std::uint64_t count);
/// The whole file.
proto::Result<std::optional<std::string>> read_whole(const std::string& path);

/// Where a GET has an object of object storage, or a part of it, for an hour: an address with a signature, which is nobody
/// else's. nullopt: the storage signs none, such as without a key.
std::optional<std::string> signed_address(const std::string& path);

/// Bytes of the file; nullopt when there is none.
std::optional<std::uint64_t> size_of(const std::string& path);

/// Size and time of last change as text, to tell whether a file is still the same; empty when it cannot be told.
std::string state_of(const std::string& path);
/// The next look at the file is at what is there now: GDAL remembers what object storage said, and a network's file system what
/// it knew of a file until that is opened.
void ask_anew(const std::string& path);
/// A state for people: with the time as a date, "723330 bytes of 2026-11-28 09:30:12.250 UTC". Other text stays as it is.
std::string told_state(const std::string& state);

/// Names in a folder, sorted; empty when there is none. "storage-read" where the storage does not answer, or the
/// folder may not be read.
proto::Result<std::vector<std::string>> names_in(const std::string& folder);
/// False when that fails.
bool remove_file(const std::string& path);

}  // namespace cordillera::raster
