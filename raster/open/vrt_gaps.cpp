// Where nothing of a VRT's sources lies GDAL reads 0, unless its band declares a nodata value or has a mask.
#include <cpl_minixml.h>
#include <cpl_string.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>

#include "raster/gdal/gdal_scope.h"
#include "raster/open/dataset.h"

namespace cordillera::raster {
namespace {

struct FreeVrt {
  void operator()(CPLXMLNode* tree) const { CPLDestroyXMLNode(tree); }
};
using VrtTree = std::unique_ptr<CPLXMLNode, FreeVrt>;

bool is_element(const CPLXMLNode& node, const char* name) { return node.eType == CXT_Element && EQUAL(node.pszValue, name); }

double number_of(const CPLXMLNode& node, const char* name, double otherwise) {
  const char* const text = CPLGetXMLValue(&node, name, nullptr);
  return text == nullptr ? otherwise : CPLAtof(text);
}

/// The band's element; null where what it reads is no rectangles of other rasters: a warp, a pan-sharpening, a function of
/// pixels.
CPLXMLNode* band_in(CPLXMLNode& tree, int number) {
  CPLXMLNode* const root = CPLGetXMLNode(&tree, "=VRTDataset");
  if (root == nullptr || CPLGetXMLNode(root, "subClass") != nullptr) return nullptr;
  for (CPLXMLNode* node = root->psChild; node != nullptr; node = node->psNext) {
    if (!is_element(*node, "VRTRasterBand") || --number > 0) continue;
    return EQUAL(CPLGetXMLValue(node, "subClass", "VRTSourcedRasterBand"), "VRTSourcedRasterBand") ? node : nullptr;
  }
  return nullptr;
}

/// From pixels of the source to pixels of the VRT along one axis.
struct SourceAxis {
  const char *offset, *size, *raster_size;
};
constexpr SourceAxis kAcross{"xOff", "xSize", "RasterXSize"}, kDown{"yOff", "ySize", "RasterYSize"};

/// The VRT's pixels that GDAL puts the source in: all that its rectangle touches, but for a thousandth of one.
std::pair<std::int64_t, std::int64_t> pixels_along(const CPLXMLNode& source, const SourceAxis& axis, int raster_px) {
  constexpr double kTouch_px = 0.001;
  const CPLXMLNode* const to = CPLGetXMLNode(const_cast<CPLXMLNode*>(&source), "DstRect");
  if (to == nullptr) return {0, raster_px};
  double begin = number_of(*to, axis.offset, 0), end = begin + number_of(*to, axis.size, 0);
  const CPLXMLNode* const from = CPLGetXMLNode(const_cast<CPLXMLNode*>(&source), "SrcRect");
  const CPLXMLNode* const is = CPLGetXMLNode(const_cast<CPLXMLNode*>(&source), "SourceProperties");
  const double source_px = is == nullptr ? 0 : number_of(*is, axis.raster_size, 0);
  if (from != nullptr && source_px > 0) {  // a rectangle may reach beyond the source
    const double first = number_of(*from, axis.offset, 0), count = number_of(*from, axis.size, 0);
    const double step = count > 0 ? (end - begin) / count : 0;
    end -= std::max(first + count - source_px, 0.0) * step;
    begin += std::max(-first, 0.0) * step;
  }
  const auto inside = [&](double place) { return static_cast<std::int64_t>(std::clamp(place, -1.0, raster_px + 1.0)); };
  return {inside(std::floor(begin + kTouch_px)), inside(std::ceil(end - kTouch_px))};
}

/// What pixels of sources of this type may be given in place of their own nodata values; null: GDAL has none to tell apart.
const char* other_nodata(GDALDataType type) {
  switch (type) {
    case GDT_Float32:
    case GDT_Float64: return "nan";
    case GDT_Int16: return "-32768";
    case GDT_UInt16: return "65535";
    case GDT_Int32: return "-2147483648";
    case GDT_UInt32: return "4294967295";
    default: return nullptr;
  }
}

/// A source may leave out pixels by a nodata value of its own, or by its mask. The band then gets a value for them, and for gaps.
bool open_with_nodata(Dataset& dataset, CPLXMLNode& tree, CPLXMLNode& band, const char* nodata) {
  static constexpr const char* kVrt[] = {"VRT", nullptr};
  CPLSetXMLValue(&band, "NoDataValue", nodata);
  CPLSetXMLValue(&band, "HideNoDataValue", "0");
  const std::unique_ptr<char, decltype(&VSIFree)> text(CPLSerializeXMLTree(CPLGetXMLNode(&tree, "=VRTDataset")), VSIFree);
  CPLStringList from;
  const std::string folder = std::filesystem::path(dataset.path).parent_path().string();
  from.SetNameValue("ROOT_PATH", folder.empty() ? "." : folder.c_str());
  GDALDatasetUniquePtr other(GDALDataset::Open(text.get(), GDAL_OF_RASTER | GDAL_OF_READONLY, kVrt, from.List(), nullptr));
  const int number = dataset.band->GetBand();
  if (!other || other->GetRasterCount() < number) return false;
  dataset.handle = std::move(other);
  dataset.band = dataset.handle->GetRasterBand(number);
  return true;
}

}  // namespace

void note_vrt_gaps(Dataset& dataset) {
  if (dataset.driver != "VRT" || dataset.mask != nullptr || (dataset.band->GetMaskFlags() & GMF_NODATA) != 0) return;
  const GdalScope scope(dataset.trust);
  const VrtTree tree(CPLParseXMLFile(dataset.path.c_str()));
  CPLXMLNode* const band = tree ? band_in(*tree, dataset.band->GetBand()) : nullptr;
  if (band == nullptr) return;
  constexpr std::array kPlaced{"SimpleSource", "ComplexSource", "AveragedSource", "NoDataFromMaskSource"};
  std::vector<Coverage::Rectangle> placed;
  bool leaves_out = false;
  for (CPLXMLNode* node = band->psChild; node != nullptr; node = node->psNext) {
    if (node->eType != CXT_Element || CPLGetXMLNode(node, "SourceFilename") == nullptr || is_element(*node, "Overview")) continue;
    if (std::none_of(kPlaced.begin(), kPlaced.end(), [&](const char* kind) { return is_element(*node, kind); })) return;
    const auto [left, right] = pixels_along(*node, kAcross, dataset.columns);
    const auto [top, bottom] = pixels_along(*node, kDown, dataset.rows);
    placed.push_back({left, top, right, bottom});
    leaves_out |= CPLGetXMLNode(node, "NODATA") != nullptr || CPLTestBool(CPLGetXMLValue(node, "UseMaskBand", "0"));
  }
  const char* const nodata = leaves_out ? other_nodata(dataset.band->GetRasterDataType()) : nullptr;
  if (nodata != nullptr && open_with_nodata(dataset, *tree, *band, nodata)) return;
  auto covered = std::make_shared<const Coverage>(std::move(placed), dataset.columns, dataset.rows);
  if (!covered->is_whole()) dataset.covered = std::move(covered);
}

}  // namespace cordillera::raster
