#include "raster/open/dataset.h"

#include <cpl_conv.h>
#include <cpl_string.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include "proto/utf8.h"
#include "raster/disk/free_space.h"
#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/open/at_hand.h"
#include "raster/open/netcdf_axes.h"
#include "raster/open/point_lines.h"
#include "raster/open/remote.h"
#include "raster/open/text_grid.h"
#include "raster/open/whole_file.h"
#include "raster/storage/ranged_file.h"
#include "raster/storage/storage.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr std::int64_t kMaxPixels = std::int64_t{1} << 36;
constexpr const char* kPoints = "XYZ";
constexpr std::uintmax_t kEmptiest = 4;  // pixels for each byte of a text of points; a point has ten bytes or more

bool is_hgt(const std::string& name) { return extension_of(name) == ".hgt"; }

/// What lies beside an unpacked raster came with it: a header, a CRS, a world file. Nothing else is unpacked.
struct OwnFiles {
  CPLConfigOptionSetter read_folder{"GDAL_DISABLE_READDIR_ON_OPEN", "FALSE", false};
  CPLConfigOptionSetter world_file{"GDAL_GEOREF_SOURCES", nullptr, false};
};

GDALDatasetUniquePtr open_handle(const AtHand& raster, const std::string& path, Trust trust) {
  static constexpr const char *kHgt[] = {"SRTMHGT", nullptr}, *kVrt[] = {"VRT", nullptr};
  const std::vector<const char*> allowed = allowed_drivers(raster.file, trust, raster.folder != nullptr);
  // One that a stranger wrote names no other files.
  const char* const* drivers = is_vrt_of_ranged_files(raster.path) ? kVrt : is_hgt(raster.file) ? kHgt : allowed.data();
  std::optional<OwnFiles> own;
  if (raster.folder) own.emplace();
  GDALDatasetUniquePtr handle(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers, nullptr, nullptr));
  std::array<double, 6> place{};
  if (own && handle)
    handle->GetGeoTransform(place.data());  // a TIFF looks for its world file when it is first asked, and no longer then
  return handle;
}

proto::Result<void> check_type(Dataset& dataset) {
  const GDALDataType type = dataset.band->GetRasterDataType();
  if (type == GDT_Unknown || GDALDataTypeIsComplex(type))
    return Problem{"raster-type", dataset.name + " holds " + GDALGetDataTypeName(type) + " pixels, which are no heights",
                   "pixels of type Byte, Int16, UInt16, Int32, UInt32, Int64, UInt64, Float32 or Float64", ""};
  if (dataset.band->GetColorTable() != nullptr)
    return Problem{"raster-type", dataset.name + " has a colour table: its pixels are numbers of colours, which are no heights",
                   "heights, such as the elevation model that the picture was made from", ""};
  const char* pixel_type = dataset.band->GetMetadataItem("PIXELTYPE", "IMAGE_STRUCTURE");
  dataset.signed_byte = pixel_type != nullptr && EQUAL(pixel_type, "SIGNEDBYTE");
  return {};
}

proto::Result<void> check_size(const Dataset& dataset, const std::string& path) {
  const std::int64_t pixels = std::int64_t{dataset.columns} * dataset.rows;
  const std::string claim =
      dataset.name + " claims " + std::to_string(dataset.columns) + " x " + std::to_string(dataset.rows) + " pixels";
  if (dataset.columns < 1 || dataset.rows < 1 || pixels > kMaxPixels)
    return Problem{"raster-too-large", claim, "at most 2^36 pixels", ""};
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
  if (error) return {};
  const bool text = dataset.driver == "AAIGrid" || dataset.driver == "USGSDEM";
  if (text && static_cast<std::uintmax_t>(pixels) > bytes)
    return Problem{"raster-truncated", claim + " but has only " + std::to_string(bytes) + " bytes", "a complete file", ""};
  // Points may leave much of their box empty, but not nearly all of it.
  if (dataset.driver == kPoints && static_cast<std::uintmax_t>(pixels) > kEmptiest * bytes)
    return Problem{"raster-too-large", claim + " in " + std::to_string(bytes) + " bytes of points",
                   "points that fill more of the box around them", ""};
  return {};
}

/// Of a stranger's header: whether it names the file of its heights by itself. Then it can name any.
proto::Result<void> check_header(const AtHand& raster, Trust trust) {
  if (trust != Trust::posted_file || extension_of(raster.file) != ".ers") return {};
  std::ostringstream text;
  text << std::ifstream(raster.path, std::ios::binary).rdbuf();
  const CPLString header = text.str();
  if (header.ifind("DataFile") == std::string::npos && header.ifind("Translated") == std::string::npos) return {};
  return Problem{"raster-format-unsupported",
                 raster.name + " names the file of its heights, which could be another of this machine",
                 "a header without DataFile, beside the file of the same name without .ers", ""};
}

/// The sizes that an .hgt can have: 1, 3 and 1 x 2 arc seconds.
bool has_size_of_hgt(const std::string& path) {
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
  return !error && (bytes == 2 * 1201 * 1201 || bytes == 2 * 3601 * 3601 || bytes == 2 * 1801 * 3601);
}

/// The line that sends a raster of this kind with what it needs.
std::string form_of(const std::string& extension) {
  return "curl -F file=@dem" + extension + " -F file=@dem" + header_of(extension);
}

/// Raw pixels of ENVI have a .hdr, too, and may be called .bil.
bool has_header_of_envi(const std::string& path) {
  for (const char* const extension : {".hdr", ".HDR"}) {
    if (first_line_of_text(fs::path(path).replace_extension(extension).string()) == "ENVI" ||
        first_line_of_text(path + extension) == "ENVI")
      return true;
  }
  return false;
}

Problem not_opened(const AtHand& raster, const std::string& message) {
  const std::string& name = raster.name;
  if (is_remote(raster.path)) {
    if (auto why = why_not_fetched(raster.path, name, message)) return *why;
  }
  if (is_side_extension(extension_of(raster.file)))
    return {"raster-format-unsupported", name + " goes with a raster, and is none itself",
            "the raster that it belongs to: dem.bil, .flt or .bip of a dem.hdr, dem.sdat of a dem.sgrd", ""};
  if (is_hgt(raster.file))
    return {"hgt-name",
            name +
                " could not be placed or read: an .hgt knows its place only by its name, and has 1201 x 1201, 3601 x 3601 "
                "or 1801 x 3601 samples of two bytes",
            "a complete file with a name such as N44W072.hgt", "name"};
  if (has_size_of_hgt(raster.path))
    return {"hgt-name",
            name + " cannot be opened as a raster; it has the size of an .hgt, which knows its place only by its name",
            "the name under which it was published, such as N44W072.hgt", "name"};
  const Format* const format = needs_others(extension_of(raster.file));
  if (format != nullptr && header_of(extension_of(raster.file)) == ".hdr" && has_header_of_envi(raster.path))
    return {"raster-format-unsupported", name + " has a header of ENVI beside it, and only Esri's are read",
            "a GeoTIFF, which this makes of it: " + copying_line("gdal_translate", raster.file), ""};
  if (format != nullptr)
    return {
        "raster-format-unsupported",
        name + " cannot be opened without its header and data (" + format->reads + ")" + (message.empty() ? "" : ": " + message),
        "all files of the raster in one .zip, or in one form: " + form_of(extension_of(raster.file)), ""};
  if (const std::string kind = signature(raster.path); !kind.empty())
    return {
        "raster-unreadable",
        name + " begins as " + kind + " and cannot be opened as a raster of that kind" + (message.empty() ? "" : ": " + message),
        "a complete, undamaged file: " + accepted_formats(raster.file), ""};
  if (message.find("Ungridded dataset") != message.npos || message.find("Couldn't determine X spacing") != message.npos) {
    // Whoever has sorted them is not told to sort them.
    if (are_sorted(raster.path))
      return {"raster-format-unsupported", name + " is points that lie on no regular grid: " + message, kAcceptedForPoints, ""};
    return {"raster-format-unsupported", name + " is points in an order that makes no grid: " + message,
            "points of a regular grid, row by row, each row from west to east: " + sorting_line(raster.path, raster.file), ""};
  }
  constexpr std::string_view kTexts = ".asc .grd .dem .xyz .txt .csv ";
  const std::string extension = extension_of(raster.file);
  const bool of_text = extension.empty() || kTexts.find(extension + " ") != kTexts.npos;
  if (const std::string line = of_text ? "" : first_line_of_text(raster.path); !line.empty())
    return {"raster-format-unsupported", name + " is text, not a raster; it begins \"" + line + "\"", accepted_formats(""), ""};
  return {"raster-format-unsupported", name + " cannot be opened as a raster" + (message.empty() ? "" : ": " + message),
          accepted_formats(raster.file), ""};
}

/// A text grid of whole numbers that has nan or inf is opened again as one of fractions: there GDAL knows them.
proto::Result<void> read_words(Dataset& dataset, const std::string& place) {
  static constexpr const char *kGrid[] = {"AAIGrid", nullptr}, *kFractions[] = {"DATATYPE=Float64", nullptr};
  if (dataset.driver != kGrid[0]) return {};
  const auto not_finite = has_not_finite(dataset.path, dataset.name);
  if (!not_finite) return not_finite.problem();
  GDALRasterBand* const band = dataset.handle->GetRasterBand(1);
  if (!*not_finite || band == nullptr || !GDALDataTypeIsInteger(band->GetRasterDataType())) return {};
  dataset.handle.reset(GDALDataset::Open(place.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, kGrid, kFractions, nullptr));
  if (dataset.handle) return {};
  return Problem{"raster-unreadable", dataset.name + " cannot be opened a second time", "a file that stays as it is", ""};
}

/// Opens what is at hand. Drivers read names and look for sidecars: a posted file gets a folder of its own with one link, for as
/// long as it is looked at by its name.
proto::Result<void> open_at_hand(Dataset& dataset, const AtHand& raster, const std::string& band,
                                 std::optional<PrivateFolder>& folder) {
  dataset.path = raster.path;
  dataset.name = raster.name;
  dataset.folder = raster.folder;
  const bool named = fs::path(raster.path).filename() == raster.file;
  const RangedFile* const ranged = ranged_file(raster.path);
  if (ranged == nullptr && !raster.folder && (dataset.trust == Trust::posted_file || (is_hgt(raster.file) && !named))) {
    dataset.path = folder.emplace().link(raster.path, raster.file);
    // A disk that fails is another matter than one that is full: who found no room waits until there is more.
    if (dataset.path.empty()) {
      std::error_code error;
      constexpr std::uint64_t kFolder_bytes = 1 << 20;
      const bool full = raster::no_room(fs::temp_directory_path(error).string(), kFolder_bytes, "").has_value();
      return Problem{full ? "storage-full" : "store-write", "no temporary folder can be made to open " + dataset.name + " in",
                     "a disk with free space", ""};
    }
  }
  if (auto whole = check_pages(dataset.path, dataset.name); !whole.ok()) return whole;
  if (auto few = check_directories(dataset.path, dataset.name); !few.ok()) return few;
  const GdalScope scope(dataset.trust);
  const std::string place = ranged != nullptr ? name_for_gdal(*ranged) : dataset.path;
  dataset.handle = open_handle(raster, place, dataset.trust);
  if (!dataset.handle) return not_opened(raster, scope.message(place, dataset.name));
  dataset.driver = dataset.handle->GetDriverName();
  // Its tree of names is its end: what a cut took from it, such as the CRS, would only seem not to have been there.
  if (dataset.driver == "HFA" && scope.failed())
    return Problem{"raster-truncated", dataset.name + " is incomplete: " + scope.message(dataset.path, dataset.name),
                   "a complete file", ""};
  if (auto whole = check_length(dataset); !whole.ok()) return whole;
  if (auto read = read_words(dataset, place); !read.ok()) return read;
  if (auto chosen = choose_raster(dataset, band); !chosen.ok()) return chosen;
  return check_netcdf_axes(dataset);
}

void note_size(Dataset& dataset) {
  dataset.columns = dataset.handle->GetRasterXSize();
  dataset.rows = dataset.handle->GetRasterYSize();
  const char* area_or_point = dataset.handle->GetMetadataItem(GDALMD_AREA_OR_POINT);
  dataset.pixel_is_point = area_or_point != nullptr && EQUAL(area_or_point, GDALMD_AOP_POINT);
}

/// Points as text, read from their copy.
proto::Result<void> open_grid(Dataset& dataset, const AtHand& grid) {
  static constexpr const char* kTiff[] = {"GTiff", nullptr};
  const GdalScope scope(dataset.trust);
  dataset.driver = kPoints;
  dataset.name = grid.name;
  dataset.path = grid.path;
  dataset.folder = grid.folder;
  dataset.handle.reset(GDALDataset::Open(grid.path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, kTiff, nullptr, nullptr));
  if (dataset.handle) return {};
  return Problem{"raster-unreadable", dataset.name + " cannot be read from its copy: " + scope.message(grid.path, dataset.name),
                 "a complete, undamaged file", ""};
}

struct Wanted {
  const AtHand& raster;
  const std::string& key;  ///< the user's file
  const std::string& band;
  const std::function<proto::Result<void>(const Dataset&)>& before_copy;
};

/// Opened, of a size that we take.
proto::Result<void> open_sized(Dataset& dataset, const Wanted& wanted, std::optional<PrivateFolder>& folder) {
  if (const auto grid = known_grid(wanted.raster, wanted.key)) {
    if (auto opened = open_grid(dataset, *grid); !opened.ok()) return opened;
    note_size(dataset);
    return {};
  }
  if (auto opened = open_at_hand(dataset, wanted.raster, wanted.band, folder); !opened.ok()) return opened;
  note_size(dataset);
  if (auto sized = check_size(dataset, wanted.raster.path); !sized.ok()) return sized;
  dataset.key = copy_key(wanted.key, wanted.raster.name);
  if (dataset.driver != kPoints) return {};
  dataset.band = dataset.handle->GetRasterBand(1);
  if (wanted.before_copy) {
    if (auto fit = wanted.before_copy(dataset); !fit.ok()) return fit;
  }
  const auto grid = gridded(wanted.raster, wanted.key, dataset.trust);
  return grid.ok() ? open_grid(dataset, *grid) : grid.problem();
}

}  // namespace

/// Of "dem/" dem, as people say it; it never is empty.
static std::string last_part(const std::string& path) {
  const fs::path whole(path);
  const std::string last = (whole.has_filename() ? whole : whole.parent_path()).filename().string();
  return last.empty() ? "\"" + path + "\"" : last;
}

/// The file that GDAL complains of: of a VRT the one that it names. Empty: none that lies elsewhere.
static std::string remote_file_in(const std::string& heard) {
  const auto at = heard.find("/vsi");
  if (at == heard.npos) return "";
  // "/vsicurl/…/a.tif, band 1: IReadBlock failed …", "`/vsicurl/…/a.tif' does not exist in the file system …".
  return heard.substr(at, heard.find(at == 0 ? ", band " : "'", at) - at);
}

/// Of a VRT whose pixels a function makes, and GDAL did not run it: nothing is damaged. Of some that fail GDAL says no word.
static std::optional<proto::Problem> told_of_function(const Dataset& dataset, const std::string& heard, const std::string& said) {
  if (dataset.driver != "VRT") return std::nullopt;
  if (heard.starts_with("Python code needs to be executed"))
    return proto::Problem{
        "raster-unreadable",
        dataset.name + " makes its pixels by a function in Python, which GDAL does not run unless it is told to trust it",
        "a copy of it, which this makes if you trust the code: GDAL_VRT_ENABLE_PYTHON=YES " +
            copying_line("gdal_translate", dataset.name),
        ""};
  const char* const* const xml = dataset.handle->GetMetadata("xml:VRT");
  const bool makes = heard.empty() && xml != nullptr && *xml != nullptr &&
                     std::string_view(*xml).find("PixelFunctionType") != std::string_view::npos;
  if (!makes && heard.find("pixel function '") == heard.npos) return std::nullopt;
  return proto::Problem{
      "raster-unreadable",
      dataset.name + " makes its pixels by a function, which GDAL could not run" + (said.empty() ? "" : " (" + said + ")"),
      "a pixel function that GDAL has here, with as many sources as it takes", ""};
}

proto::Problem unreadable_pixels(const Dataset& dataset, const GdalScope& scope) {
  const std::string heard = CPLGetLastErrorMsg(), said = scope.message(dataset.path, dataset.name);
  if (auto why = told_of_function(dataset, heard, said)) return *why;
  const std::string part = dataset.trust == Trust::operator_file ? remote_file_in(heard) : "";
  const bool fetched = is_remote(dataset.path) || !part.empty();
  if (fetched) {
    const std::string name = part.empty() || part == dataset.path ? dataset.name : fs::path(part).filename().string();
    if (auto why = why_not_fetched(part.empty() ? dataset.path : part, name, heard)) return *why;
  } else if (dataset.trust == Trust::operator_file) {
    if (auto why = told_of_network(dataset.name, heard)) return *why;
  }
  return {"raster-unreadable",
          dataset.name + " is damaged" + (fetched ? ", or its server failed for a moment" : "") + ": its pixels cannot be read" +
              (said.empty() ? "" : " (" + said + ")"),
          fetched ? "a complete, undamaged file; or trying again" : "a complete, undamaged file", ""};
}

proto::Result<Dataset> open_dataset(const std::string& path, const std::string& name, Trust trust, const std::string& band,
                                    const std::function<proto::Result<void>(const Dataset&)>& before_copy) {
  Dataset dataset;
  dataset.trust = trust;
  const std::string called = last_part(name.empty() ? path : name);
  if (auto sniffed = sniff(path, called, trust); !sniffed.ok()) return sniffed.problem();
  const auto raster = at_hand(path, called, trust);
  if (!raster) return raster.problem();
  if (raster->folder) {
    if (auto sniffed = sniff(raster->path, raster->name, trust); !sniffed.ok()) return sniffed.problem();
  }
  if (auto headed = check_header(*raster, trust); !headed.ok()) return headed.problem();
  std::optional<PrivateFolder> folder;
  if (auto opened = open_sized(dataset, {*raster, path, band, before_copy}, folder); !opened.ok()) return opened.problem();
  const GdalScope scope(trust);
  if (auto chosen = choose_band(dataset, band); !chosen.ok()) return chosen.problem();
  if (auto typed = check_type(dataset); !typed.ok()) return typed.problem();
  if (auto blocks = check_tiff_blocks(dataset); !blocks.ok()) return blocks.problem();
  note_vrt_gaps(dataset);
  return dataset;
}

}  // namespace cordillera::raster
