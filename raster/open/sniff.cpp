#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "proto/letters.h"
#include "proto/utf8.h"
#include "raster/gdal/formats.h"
#include "raster/open/dataset.h"
#include "raster/open/point_lines.h"
#include "raster/storage/ranged_file.h"

namespace cordillera::raster {
namespace {

bool begins(const std::string& text, std::string_view with) { return text.compare(0, with.size(), with) == 0; }

struct FileKind {
  std::string what;      ///< in a sentence; empty: it may be a raster, or an archive of one
  bool picture = false;  ///< GDAL reads it
  bool points = false;   ///< or lines: of which a raster can be made
  bool packed = false;   ///< in a way that is not unpacked here
};

constexpr std::string_view kXz("\3757zXZ\0", 6);
constexpr std::pair<std::string_view, const char*> kPackings[] = {
    {kXz, "xz"}, {"7z\xbc\xaf\x27\x1c", "7-Zip"}, {"Rar!\x1a", "RAR"}, {"\x28\xb5\x2f\xfd", "Zstandard"}};
constexpr std::size_t kTarMark = 257;

/// What a server sends in place of a file that it does not give, under the file's name. text: without blanks before.
std::string page_of(const std::string& text, const std::string& head) {
  const std::string small = proto::lower(head);
  const auto opens = [&](std::string_view mark) { return proto::lower(text).starts_with(mark); };
  const auto has = [&](std::string_view mark) { return small.find(mark) != small.npos; };
  if (opens("<!doctype html") || opens("<html") || (opens("<?xml") && has("<html"))) return "is an HTML page, not a raster";
  const bool error = has("<error>") || has("exceptionreport");  // of a storage such as S3; of OGC's services
  if (error && (opens("<?xml") || opens("<error>"))) return "is an error of a server in XML, not a raster";
  const std::size_t second = text.find_first_not_of(" \t\r\n", 1);
  if (opens("{") && second != text.npos && (text[second] == '"' || text[second] == '}')) return "is JSON, not a raster";
  return "";
}

/// What the first bytes say the file is.
FileKind kind_of(const std::string& head) {
  if (begins(head, "version https://git-lfs"))
    return {"is the text of a Git LFS pointer, not the file it points at (run git lfs pull)"};
  if (head.compare(0, 2, "--") == 0 && head.find("Content-Disposition: form-data") != head.npos)
    return {"is a form, and its Content-Type did not say so (clients set it by themselves)"};
  if (begins(head, "BZh") && head.compare(4, 6, "1AY&SY") == 0) return {.what = "is packed with bzip2", .packed = true};
  for (const auto& [mark, way] : kPackings)
    if (begins(head, mark)) return {.what = std::string("is packed with ") + way, .packed = true};
  if (head.size() > kTarMark && head.compare(kTarMark, 5, "ustar") == 0) return {.what = "is a tar archive", .packed = true};
  if (begins(head, "\x89PNG")) return {"is a PNG picture", true};
  if (begins(head, "\xff\xd8\xff")) return {"is a JPEG picture", true};
  if (begins(head, "%PDF")) return {"is a PDF document"};
  if (begins(head, "LASF")) return {"is a point cloud (LAS, LAZ)", false, true};
  if (begins(head, std::string_view("\0\0\x27\x0a", 4))) return {"is a shapefile, of points, lines or areas", false, true};
  if (begins(head, "glTF") || begins(head, "ply\n") || begins(head, "ply\r")) return {"is a mesh"};
  const std::size_t first = head.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first == std::string::npos) return {};
  const std::string text = head.substr(first, 64);
  if (std::string what = page_of(text, head); !what.empty()) return {std::move(what)};
  if (head.find("<gpx") != head.npos) return {"is a GPX track, of points and lines", false, true};
  if (head.find("<kml") != head.npos) return {"is KML, of points, lines or areas", false, true};
  return {};
}

std::string head_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string head(512, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  return head;
}

}  // namespace

std::string signature(const std::string& path) {
  static constexpr std::pair<const char*, const char*> kMarks[] = {{"\x89HDF", "a NetCDF or HDF5 file"},
                                                                   {"CDF", "a NetCDF file"},
                                                                   {"EHFA_HEADER_TAG", "an Erdas file"},
                                                                   {"SQLite format 3", "a GeoPackage"},
                                                                   {"\xff\x4f\xff\x51", "JPEG 2000"}};
  const std::string head = head_of(path);
  for (const auto& [mark, kind] : kMarks)
    if (begins(head, mark)) return kind;
  return head.size() > 8 && head.compare(4, 4, "jP  ") == 0 ? "JPEG 2000" : "";
}

std::string first_line_of_text(const std::string& path) {
  const std::string head = head_of(path);
  const auto is_text = [](unsigned char c) { return c >= ' ' || c == '\t' || c == '\r' || c == '\n'; };
  if (!std::all_of(head.begin(), head.end(), is_text)) return "";
  const std::size_t first = head.find_first_not_of(" \t\r\n");
  if (first == head.npos) return "";
  return proto::shown_text(head.substr(first, head.find_first_of("\r\n", first) - first), 60);
}

proto::Result<void> sniff(const std::string& path, const std::string& name, Trust trust) {
  std::error_code error;
  const bool regular = std::filesystem::is_regular_file(path, error);
  if (trust == Trust::posted_file && !regular)
    return proto::Problem{"raster-not-found", name + " is not a file", accepted_formats(""), ""};
  if (!regular) {
    // From the command line GDAL's own file systems are welcome; a plain path must exist.
    if (begins(path, "/vsi")) return {};
    // Of what is missing no format is wrong.
    const bool there = std::filesystem::exists(path, error);
    return proto::Problem{"raster-not-found", name + (there ? " is not a file" : " does not exist"),
                          there ? accepted_formats("") : "", ""};
  }
  if (access(path.c_str(), R_OK) != 0)
    return proto::Problem{"raster-empty", name + " cannot be read: " + std::strerror(errno), "a file that this user may read",
                          ""};
  const std::string head = head_of(path);
  if (head.empty()) return proto::Problem{"raster-empty", name + " is empty or cannot be read", accepted_formats(""), ""};
  const FileKind kind = kind_of(head);
  if (kind.points) return proto::Problem{"raster-format-unsupported", name + " " + kind.what, kAcceptedForPoints, ""};
  if (kind.packed)
    return proto::Problem{"raster-format-unsupported", name + " " + kind.what,
                          "the raster that it holds, as it is or in a .zip or .gz", ""};
  if (!kind.what.empty())
    return proto::Problem{"raster-format-unsupported", name + " " + kind.what, accepted_formats(kind.picture ? name : ""), ""};
  if (trust == Trust::posted_file && !is_vrt_of_ranged_files(path) && head.find("<VRTDataset") != std::string::npos)
    return proto::Problem{"raster-format-unsupported", name + " is a VRT, which can point at other files of this machine",
                          accepted_formats(name), ""};
  return {};
}

}  // namespace cordillera::raster
