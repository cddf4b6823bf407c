#include <filesystem>
#include <fstream>

#include "raster/dataset.h"

namespace cordillera::raster {
namespace {

bool begins(const std::string& text, std::string_view with) { return text.compare(0, with.size(), with) == 0; }

/// What the first bytes say the file is; empty when they may be a raster's.
std::string kind_of(const std::string& head) {
  using namespace std::string_view_literals;
  if (begins(head, "version https://git-lfs")) return "is the text of a Git LFS pointer, not the file it points at (run git lfs pull)";
  if (begins(head, "\x89PNG")) return "is a PNG picture";
  if (begins(head, "\xff\xd8\xff")) return "is a JPEG picture";
  if (begins(head, "PK\x03\x04")) return "is a zip archive";
  if (begins(head, "\x1f\x8b")) return "is a gzip archive";
  if (begins(head, "%PDF")) return "is a PDF document";
  if (begins(head, "\x89HDF") || begins(head, "CDF")) return "is an HDF or NetCDF file";
  const std::size_t first = head.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first == std::string::npos) return "";
  const std::string text = head.substr(first, 64);
  if (begins(text, "<!DOCTYPE html") || begins(text, "<html")) return "is an HTML page";
  return "";
}

}  // namespace

proto::Result<void> sniff(const std::string& path, const std::string& name, Trust trust) {
  std::error_code error;
  const bool regular = std::filesystem::is_regular_file(path, error);
  if (trust == Trust::posted_file && !regular) return proto::Problem{"raster-not-found", name + " is not a file", kAcceptedFormats, ""};
  if (!regular) {
    // From the command line GDAL's own file systems are welcome; a plain path must exist.
    if (begins(path, "/vsi")) return {};
    return proto::Problem{"raster-not-found", name + " does not exist or is not a file", kAcceptedFormats, ""};
  }
  std::ifstream file(path, std::ios::binary);
  std::string head(256, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  if (head.empty()) return proto::Problem{"raster-empty", name + " is empty or cannot be read", kAcceptedFormats, ""};
  const std::string kind = kind_of(head);
  if (!kind.empty()) return proto::Problem{"raster-format-unsupported", name + " " + kind, kAcceptedFormats, ""};
  if (trust == Trust::posted_file && head.find("<VRTDataset") != std::string::npos)
    return proto::Problem{"raster-format-unsupported", name + " is a VRT, which can point at other files of this machine", kAcceptedFormats, ""};
  return {};
}

}  // namespace cordillera::raster
