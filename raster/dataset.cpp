#include "raster/dataset.h"

#include <cpl_string.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>

#include "raster/gdal_scope.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr std::int64_t kMaxPixels = std::int64_t{1} << 36;

bool is_hgt(const std::string& name) {
  std::string extension = fs::path(name).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension == ".hgt";
}

/// A private folder with one link named as the user named the file: drivers that read names see the right one, and drivers that
/// look for sidecars find none. Removed as soon as the file is open.
class Link {
 public:
  Link(const std::string& target, const std::string& name) {
    std::error_code error;
    std::string folder = (fs::temp_directory_path(error) / "cordillera-XXXXXX").string();
    if (error || mkdtemp(folder.data()) == nullptr) return;
    folder_ = folder;
    const std::string path = (fs::path(folder) / safe(name)).string();
    fs::create_symlink(fs::absolute(target, error), path, error);
    if (!error) path_ = path;
  }
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  ~Link() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove(path_, ignored);
    if (!folder_.empty()) fs::remove(folder_, ignored);
  }
  const std::string& path() const { return path_; }  ///< empty: could not be made

 private:
  static std::string safe(std::string name) {
    for (char& c : name)
      if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-' && c != '_') c = '_';
    if (name.empty() || name[0] == '.') name.insert(0, "raster");
    return name.size() > 200 ? name.substr(name.size() - 200) : name;
  }
  std::string folder_, path_;
};

std::vector<const char*> drivers(Trust trust, bool hgt) {
  if (hgt) return {"SRTMHGT", nullptr};
  if (trust == Trust::posted_file) return {"GTiff", "AAIGrid", "USGSDEM", nullptr};
  return {"GTiff", "AAIGrid", "USGSDEM", "VRT", nullptr};
}

GDALDatasetUniquePtr open_handle(const std::string& path, Trust trust, bool hgt) {
  const std::vector<const char*> allowed = drivers(trust, hgt);
  return GDALDatasetUniquePtr(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, allowed.data(), nullptr, nullptr));
}

proto::Result<void> check_bands(Dataset& dataset) {
  const int bands = dataset.handle->GetRasterCount();
  const bool alpha = bands == 2 && dataset.handle->GetRasterBand(2)->GetColorInterpretation() == GCI_AlphaBand;
  if (bands != 1 && !alpha)
    return Problem{"raster-bands", dataset.name + " has " + std::to_string(bands) + " bands; an elevation model has one", kAcceptedFormats, ""};
  dataset.band = dataset.handle->GetRasterBand(1);
  const GDALDataType type = dataset.band->GetRasterDataType();
  if (type == GDT_Unknown || GDALDataTypeIsComplex(type))
    return Problem{"raster-type", dataset.name + " holds " + GDALGetDataTypeName(type) + " pixels, which are no heights",
                   "pixels of type Byte, Int16, UInt16, Int32, UInt32, Int64, UInt64, Float32 or Float64", ""};
  if (dataset.band->GetColorTable() != nullptr)
    return Problem{"raster-type", dataset.name + " has a colour table: its pixels are numbers of colours, which are no heights",
                   "heights, such as the elevation model that the picture was made from", ""};
  const char* pixel_type = dataset.band->GetMetadataItem("PIXELTYPE", "IMAGE_STRUCTURE");
  dataset.signed_byte = pixel_type != nullptr && EQUAL(pixel_type, "SIGNEDBYTE");
  const int flags = dataset.band->GetMaskFlags();
  if (alpha || (flags & (GMF_ALL_VALID | GMF_NODATA)) == 0)
    dataset.mask = alpha ? dataset.handle->GetRasterBand(2) : dataset.band->GetMaskBand();
  return {};
}

proto::Result<void> check_size(const Dataset& dataset, const std::string& path) {
  const std::int64_t pixels = std::int64_t{dataset.columns} * dataset.rows;
  const std::string claim = dataset.name + " claims " + std::to_string(dataset.columns) + " x " + std::to_string(dataset.rows) + " pixels";
  if (dataset.columns < 1 || dataset.rows < 1 || pixels > kMaxPixels)
    return Problem{"raster-too-large", claim, "at most 2^36 pixels", ""};
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
  const bool text = dataset.driver == "AAIGrid" || dataset.driver == "USGSDEM";
  if (!error && text && static_cast<std::uintmax_t>(pixels) > bytes)
    return Problem{"raster-truncated", claim + " but has only " + std::to_string(bytes) + " bytes", "a complete file", ""};
  return {};
}

/// The sizes that an .hgt can have: 1, 3 and 1 x 2 arc seconds.
bool has_size_of_hgt(const std::string& path) {
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
  return !error && (bytes == 2 * 1201 * 1201 || bytes == 2 * 3601 * 3601 || bytes == 2 * 1801 * 3601);
}

Problem not_opened(const std::string& path, const std::string& name, const std::string& message, bool hgt) {
  if (hgt)
    return {"hgt-name", name + " could not be placed or read: an .hgt knows its place only by its name, and has 1201 x 1201, 3601 x 3601 "
            "or 1801 x 3601 samples of two bytes", "a complete file with a name such as N44W072.hgt", "name"};
  if (has_size_of_hgt(path))
    return {"hgt-name", name + " cannot be opened as a raster; it has the size of an .hgt, which knows its place only by its name",
            "the name under which it was published, such as N44W072.hgt", "name"};
  return {"raster-format-unsupported", name + " cannot be opened as a raster" + (message.empty() ? "" : ": " + message), kAcceptedFormats, ""};
}

}  // namespace

proto::Result<Dataset> open_dataset(const std::string& path, const std::string& name, Trust trust) {
  Dataset dataset;
  dataset.trust = trust;
  dataset.name = fs::path(name.empty() ? path : name).filename().string();
  if (auto sniffed = sniff(path, dataset.name, trust); !sniffed.ok()) return sniffed.problem();

  const GdalScope scope(trust);
  const bool hgt = is_hgt(dataset.name);
  std::optional<Link> link;
  dataset.path = path;
  if (trust == Trust::posted_file || (hgt && fs::path(path).filename() != dataset.name)) {
    link.emplace(path, dataset.name);
    if (link->path().empty()) return Problem{"storage-full", "no temporary folder can be made to open " + dataset.name + " in", "a disk with free space", ""};
    dataset.path = link->path();
  }
  dataset.handle = open_handle(dataset.path, trust, hgt);
  if (!dataset.handle) return not_opened(path, dataset.name, scope.message(dataset.path, dataset.name), hgt);
  dataset.driver = dataset.handle->GetDriverName();
  dataset.columns = dataset.handle->GetRasterXSize();
  dataset.rows = dataset.handle->GetRasterYSize();
  const char* area_or_point = dataset.handle->GetMetadataItem(GDALMD_AREA_OR_POINT);
  dataset.pixel_is_point = area_or_point != nullptr && EQUAL(area_or_point, GDALMD_AOP_POINT);
  if (auto sized = check_size(dataset, path); !sized.ok()) return sized.problem();
  if (auto banded = check_bands(dataset); !banded.ok()) return banded.problem();
  if (auto blocks = check_tiff_blocks(dataset); !blocks.ok()) return blocks.problem();
  return dataset;
}

}  // namespace cordillera::raster
