#pragma once
// A raster as it is sent: in a zip with its side files, or in a gz.
#include <atomic>
#include <cstdint>
#include <string>

#include "proto/result.h"
#include "raster/disk/private_folder.h"

namespace cordillera::raster {

/// By the file's first bytes: zip or gzip.
bool is_archive(const std::string& path);

/// How much may be unpacked: so many times the archive's size, and in any case so many bytes. A megabyte can hold a gigabyte of
/// zeros, and that is what most bombs are; but seas shrink by a factor of a thousand, too.
struct UnpackLimit {
  std::uint64_t times = 64;
  std::uint64_t at_least = std::uint64_t{1} << 30;
};

/// A file of an archive, unpacked.
struct Member {
  std::string path;  ///< in the folder
  std::string name;  ///< in the archive, without folders: an .hgt knows its place by it
};

/// The one raster of the archive, into the folder, with the files of the same name that its format may need; no other file of the
/// archive. Where an entry says it lies is never a place to write to. name: what the user called the archive. Problems:
/// "archive-rasters" (none, or several), "archive-too-large", "archive-unreadable", "storage-full".
proto::Result<Member> unpack(const std::string& path, const std::string& name, const PrivateFolder& folder,
                             const UnpackLimit& limit = {});

/// Of a zip that somebody made of a folder: all files beside the first one of this name and below, into the folder, under their
/// own paths. An entry that leads elsewhere is a problem. False: there is no such file in it, and nothing was unpacked. The
/// archive is the user's own: what it may unpack to is what its disk has room for. stop: asked once a file; may be null.
/// Problems: those of unpack, and "cancelled".
proto::Result<bool> unpack_folder(const std::string& path, const std::string& name, const std::string& marker,
                                  const PrivateFolder& folder, const std::atomic<bool>* stop = nullptr);

}  // namespace cordillera::raster
