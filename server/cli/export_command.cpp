// cordillera export: a finished dataset as one file, or a part of it as one mesh.
#include <algorithm>
#include <exception>
#include <filesystem>
#include <iostream>

#include "pipeline/exports/archive_3tz.h"
#include "pipeline/exports/export.h"
#include "pipeline/exports/mbtiles.h"
#include "pipeline/exports/mesh/mesh_output.h"
#include "pipeline/exports/pmtiles.h"
#include "pipeline/exports/whole_file.h"
#include "pipeline/faces/tiles_3d/photo_texture.h"
#include "pipeline/store/sqlite.h"
#include "proto/letters.h"
#include "raster/gdal/formats.h"
#include "server/cli/export_command.h"
#include "server/cli/path_kind.h"
#include "server/cli/progress_bar.h"
#include "server/options/mesh_options.h"
#include "server/sandbox/asked_to_stop.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using namespace pipeline::exports;
using pipeline::faces::Face;
using pipeline::faces::Terrain;
using proto::Problem;

std::string endings() { return ".pmtiles, .mbtiles, .3tz, " + mesh_endings_text(" or "); }

/// A kind of archive: what its files are called, which faces it can hold, and how it is written.
struct ArchiveKind {
  std::string_view ending;
  bool (*fits)(const Face&);
  proto::Result<void> (*write)(const Terrain&, const Face&, const std::string&, pipeline::Existing, const ExportWork&);
};
constexpr ArchiveKind kArchives[] = {
    {"pmtiles", fits_pmtiles, write_pmtiles}, {"mbtiles", fits_mbtiles, write_mbtiles}, {"3tz", fits_3tz, write_3tz}};

std::string ending_of(const std::string& path) {
  const std::string ending = proto::lower(fs::path(path).extension().string());
  return ending.empty() ? ending : ending.substr(1);
}

/// The file itself, or a folder with a dataset's file, as the server keeps it.
proto::Result<std::unique_ptr<pipeline::StoreReader>> open_source(const std::string& source) {
  std::error_code error;
  const std::string accepted = "a file that `cordillera build -o NAME.sqlite` made, or a dataset's folder in a server's data";
  if (auto closed = refuse_closed(source, "source")) return *closed;
  if (!fs::exists(source, error)) return Problem{"file-unreadable", "there is no " + source, accepted, "source"};
  if (raster::is_raster_extension(raster::extension_of(source)) && path_kind(source) == PathKind::raster)
    return Problem{"file-unreadable", source + " is a raster, and export takes what was built of one",
                   "cordillera build " + source + " -o FILE, with the same FILE: it goes from the raster to the archive or mesh",
                   "source"};
  if (!fs::is_directory(source, error)) return pipeline::StoreReader::open(source);
  const fs::path inside = fs::path(source) / kStoreFile;
  if (!fs::exists(inside, error)) return Problem{"file-unreadable", source + " holds no " + kStoreFile, accepted, "source"};
  return pipeline::StoreReader::open(inside.string());
}

std::string names_of(const ArchiveKind& archive) {
  std::string names;
  for (const Face* face : pipeline::faces::all_faces()) {
    if (archive.fits(*face)) names.append(names.empty() ? "" : ", ").append(face->name);
  }
  return names;
}

/// The one that was named; else pictures where the archive can hold any, since most programs that open it are maps, or its first.
proto::Result<const Face*> face_for(const ArchiveKind& archive, const std::string& name) {
  const Face* first = nullptr;
  for (const Face* face : pipeline::faces::all_faces()) {
    if (!archive.fits(*face) || (!name.empty() && face->name != name)) continue;
    if (!name.empty() || fits_mbtiles(*face)) return face;
    if (first == nullptr) first = face;
  }
  if (first != nullptr) return first;
  const std::string what = name.empty() ? "no format" : "no format '" + name + "'";
  return Problem{"usage", "a ." + std::string(archive.ending) + " holds " + what, names_of(archive), "--format"};
}

/// 0: one for each usable core.
proto::Result<unsigned> threads_of(const ExportLine& line) {
  std::uint32_t threads = 0;
  if (line.threads.empty()) return threads;
  if (const Complaint complaint = read_whole(line.threads, {0, 1024}, &threads))
    return wrong_value("--threads", line.threads, *complaint, "0 to 1024");
  return threads;
}

proto::Result<std::string> export_archive(const ArchiveKind& archive, const ExportLine& line, const Terrain& terrain,
                                          const pipeline::ProgressCallback& progress) {
  if (!line.mesh.empty()) {
    return Problem{"usage", line.mesh.front().first + " is for meshes: a ." + std::string(archive.ending) + " holds all tiles",
                   mesh_endings_text(" or "), line.mesh.front().first};
  }
  const auto face = face_for(archive, line.format);
  if (!face) return face.problem();
  const auto threads = threads_of(line);
  if (!threads) return threads.problem();
  const ExportWork work(*threads, progress);
  if (auto written = archive.write(terrain, **face, line.output, line.other, work); !written) return written.problem();
  return std::string((*face)->name) + " written to " + line.output;
}

proto::Result<std::string> export_mesh(MeshKind kind, const ExportLine& line, const Terrain& terrain,
                                       const pipeline::ProgressCallback& progress) {
  auto request = mesh_request(line.mesh, Spelling::command_line);
  if (!request) return request.problem();
  if (!line.most_triangles.empty()) {
    double most = 0;
    if (const Complaint complaint = read_number(line.most_triangles, {1, 1e8}, &most))
      return wrong_value("--max-triangles", line.most_triangles, *complaint, "1 to 100000000");
    request->most_triangles = static_cast<std::uint64_t>(most);
  }
  if (const auto held = check_frame(kind, request->frame); !held) return held.problem();
  const auto mesh = extract_mesh(terrain, *request, progress);
  if (!mesh) return mesh.problem();
  proto::Progress writing;
  writing.set_stage("write");
  if (progress) progress(writing);
  const auto written = write_export(line.output, line.other, [&](const fs::path& sibling) {
    std::ofstream out = opened(sibling);
    write_mesh(out, *mesh, kind, terrain.manifest());
    if (terrain.is_stopped()) throw Refused{kStopped};
  });
  if (!written) return written.problem();
  return "level " + std::to_string(mesh->level) + ", " + std::to_string(mesh->mesh.vertices()) + " vertices, " +
         std::to_string(mesh->mesh.triangles.size()) + " triangles written to " + line.output;
}

const ArchiveKind* archive_of(const std::string& output) {
  const auto* const found = std::find_if(std::begin(kArchives), std::end(kArchives),
                                         [ending = ending_of(output)](const ArchiveKind& kind) { return kind.ending == ending; });
  return found == std::end(kArchives) ? nullptr : found;
}

proto::Result<std::string> export_of(const ExportLine& line) {
  if (auto possible = check_export(line); !possible) return possible.problem();
  auto store = open_source(line.source);
  if (!store) return store.problem();
  const auto look = look_of(line.look);
  if (!look) return look.problem();
  const Terrain terrain(std::move(*store), *look, &g_asked_to_stop);
  if (const auto shown = pipeline::faces::check_photo(terrain); !shown) return shown.problem();
  const ArchiveKind* const archive = archive_of(line.output);
  ProgressBar bar(ProgressBar::style_of(line.words == Verbosity::all), kBarPatience);
  const auto show = bar.callback();
  try {
    return archive != nullptr ? export_archive(*archive, line, terrain, show)
                              : export_mesh(*mesh_kind(ending_of(line.output)), line, terrain, show);
  } catch (const pipeline::StoreError& damage) {  // a mesh is put together before it is written
    return pipeline::exports::damaged(line.source, damage);
  }
}

}  // namespace

bool is_archive_name(const std::string& output) { return archive_of(output) != nullptr; }
bool is_export_name(const std::string& output) { return archive_of(output) != nullptr || mesh_kind(ending_of(output)); }

std::string archived_face_names() {
  std::string names;
  for (const Face* face : pipeline::faces::all_faces()) {
    if (std::any_of(std::begin(kArchives), std::end(kArchives), [&](const ArchiveKind& kind) { return kind.fits(*face); }))
      names.append(names.empty() ? "" : ", ").append(face->name);
  }
  return names;
}

const Face* face_in_archive(const std::string& output, const std::string& format) {
  const ArchiveKind* const archive = archive_of(output);
  const auto face = archive != nullptr ? face_for(*archive, format) : proto::Result<const Face*>(nullptr);
  return face ? *face : nullptr;
}

proto::Result<void> check_export(const ExportLine& line) {
  if (line.output.empty()) { return Problem{"usage", "export needs to know where to write", "-o FILE" + endings(), "--output"}; }
  const ArchiveKind* const archive = archive_of(line.output);
  if (archive == nullptr && !mesh_kind(ending_of(line.output))) {
    return Problem{"usage", "the name " + line.output + " does not say what to write", endings(), "--output"};
  }
  if (const auto threads = threads_of(line); !threads) return threads.problem();
  if (archive == nullptr) {
    if (!line.threads.empty()) {
      return Problem{"usage", "--threads is for archives: a mesh is made by one thread", ".pmtiles, .mbtiles or .3tz",
                     "--threads"};
    }
    if (!line.format.empty()) {
      return Problem{"usage", "formats are for archives: the file's name says what mesh it is", ".pmtiles, .mbtiles or .3tz",
                     "--format"};
    }
    if (const LookOption* const look = look_of_others(line.look, {}))
      return Problem{"usage", std::string(look->name) + " is for " + look->what + ": " + line.output + " is to be a mesh",
                     look->archives, look->name};
  } else if (const auto face = face_for(*archive, line.format); !face) {
    return face.problem();
  } else if (const LookOption* const look = look_of_others(line.look, std::span(&*face, 1))) {
    return Problem{
        "usage",
        std::string(look->name) + " is for " + look->what + ": " + line.output + " is to hold " + std::string((*face)->name),
        look->archives, look->name};
  }
  return check_output_file(line.output, line.other);
}

/// Bytes of a store that cannot be read are found while they are needed.
proto::Result<std::string> export_file(const ExportLine& line) {
  try {
    return export_of(line);
  } catch (const std::exception& error) {
    return Problem{"store-damaged", line.source + " cannot be exported: " + error.what(),
                   "the store of a dataset whose build has finished", "source"};
  }
}

ExportLine export_line(const OutputLine& line) {
  ExportLine told;
  told.output = line.output;
  told.format = line.only_format;
  told.look = line.look;
  told.other = line.other;
  told.words = line.words;
  return told;
}

proto::Result<void> export_folder(const std::string& store, const OutputLine& line, const pipeline::faces::Look& look,
                                  const fs::path& folder, unsigned threads) {
  auto reader = pipeline::StoreReader::open(store);
  if (!reader) return reader.problem();
  const Terrain terrain(std::move(reader).value(), look, &g_asked_to_stop);
  if (auto shown = pipeline::faces::check_photo(terrain); !shown) return shown;
  ProgressBar bar(ProgressBar::style_of(line.words == Verbosity::all), kBarPatience);
  return pipeline::export_static(terrain, line.formats, folder.string(), line.other, {threads, bar.callback()});
}

int export_command(const ExportLine& line) {
  stop_on({SIGINT, SIGTERM, SIGHUP}, SecondTime::ends);
  const auto said = export_file(line);
  if (said) {
    if (line.words == Verbosity::all) std::cout << *said << "\n";
    return kDone;
  }
  complain(said.problem());
  const std::string& type = said.problem().type;
  return type == "usage" || type.starts_with("option") ? kUsage : kFailed;
}

}  // namespace cordillera::server
