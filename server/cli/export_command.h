#pragma once
// cordillera export.
#include <filesystem>
#include <string>

#include "server/cli/commands.h"

namespace cordillera::server {

struct ExportLine {
  std::string source;
  std::string output;          ///< its ending says what is written
  std::string format;          ///< of an archive: a face's name; empty: the one most programs read
  LookWords look;              ///< of an archive's tiles
  Given mesh;                  ///< options of a mesh, as given
  std::string most_triangles;  ///< of a mesh; empty: ten million
  std::string threads;         ///< that make the tiles of an archive; empty: one for each usable core
  pipeline::Existing other = pipeline::Existing::refuse;
  Verbosity words = Verbosity::all;
};
int export_command(const ExportLine& line);

/// Whether a file of this name is one that export writes: an archive or a mesh.
bool is_export_name(const std::string& output);
/// "drc, 3d-tiles, …": the formats that some archive can hold.
std::string archived_face_names();
/// Whether it is an archive's.
bool is_archive_name(const std::string& output);
/// The format that an archive of this name holds; format: as in ExportLine. Null: it is no archive, or can hold no such format.
const pipeline::faces::Face* face_in_archive(const std::string& output, const std::string& format);
/// Whether the line can be done, as far as that shows before there is a dataset.
proto::Result<void> check_export(const ExportLine& line);
/// Does it. What was written, in words.
proto::Result<std::string> export_file(const ExportLine& line);

/// What export is told of an archive or a mesh that another command writes.
ExportLine export_line(const OutputLine& line);
/// Writes a store's static folder. threads: 0: one for each usable core.
proto::Result<void> export_folder(const std::string& store, const OutputLine& line, const pipeline::faces::Look& look,
                                  const std::filesystem::path& folder, unsigned threads);

}  // namespace cordillera::server
