#pragma once
// live.json: which datasets came of which files of which folder. Whoever mistakes it removes datasets or makes them twice, so
// what cannot be read is refused and never taken for an empty one.
#include <filesystem>
#include <map>
#include <string>

#include "proto/result.h"
#include "server/live/side_files.h"

namespace cordillera::server {

struct LiveNote {
  std::string dataset;  ///< id; empty: none could be made of the file
  FilePrint print;      ///< of the bytes that it has
  std::string source;   ///< the raster of the dataset that came of the file; empty: noted before that was
};

struct LiveNotes {
  std::string folder;  ///< real path; empty: noted before folders were
  std::map<std::string, LiveNote> by_path;
};

/// Of a live folder, which is there. No file: empty ones. Problems: "data-unusable", where the file is another or damaged, and
/// "options-conflict", where it is of another folder.
proto::Result<LiveNotes> read_live_notes(const std::filesystem::path& file, const std::filesystem::path& folder);
proto::Result<void> write_live_notes(const std::filesystem::path& file, const LiveNotes& notes);

}  // namespace cordillera::server
