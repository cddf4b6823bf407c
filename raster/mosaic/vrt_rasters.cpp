#include "raster/mosaic/vrt_rasters.h"

#include <cpl_minixml.h>
#include <cpl_string.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <memory>
#include <string_view>
#include <utility>

#include "proto/utf8.h"
#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

struct FreeTree {
  void operator()(CPLXMLNode* tree) const { CPLDestroyXMLNode(tree); }
};
using Tree = std::unique_ptr<CPLXMLNode, FreeTree>;

Problem unsupported(const std::string& name, const std::string& what) {
  return {"raster-format-unsupported", name + " is a VRT with " + what,
          "a VRT of parts of rasters, as gdalbuildvrt and gdal_translate make it", ""};
}

/// Whether the node has this name, as GDAL compares them.
bool is_called(const CPLXMLNode& node, const char* name) { return node.pszValue != nullptr && EQUAL(node.pszValue, name); }

/// A walk through all of the tree. GDAL refuses trees that are too deep for it.
class Walk {
 public:
  Walk(const std::string& name, const std::function<std::string(std::size_t, const std::string&)>& called)
      : name_(name), called_(called) {}

  proto::Result<void> go(CPLXMLNode* first) {
    for (CPLXMLNode* node = first; node != nullptr; node = node->psNext) {
      if (node->eType == CXT_Attribute && is_called(*node, "subClass")) {
        const std::string kind = CPLGetXMLValue(node, nullptr, "");
        if (kind != "VRTSourcedRasterBand") return unsupported(name_, "a " + proto::shown_text(kind));
      }
      if (node->eType != CXT_Element) continue;
      for (const char* other : {"SourceDataset", "GDALWarpOptions", "PixelFunctionType", "PixelFunctionCode"})
        if (is_called(*node, other)) return unsupported(name_, "<" + std::string(other) + ">");
      if (is_called(*node, "SourceFilename")) {
        if (auto renamed = rename(*node); !renamed.ok()) return renamed;
      } else if (auto done = go(node->psChild); !done.ok()) {
        return done;
      }
    }
    return {};
  }

  std::vector<std::string> written() { return std::move(written_); }

 private:
  proto::Result<void> rename(CPLXMLNode& node) {
    std::string path = CPLGetXMLValue(&node, nullptr, "");
    // A file of the machine that it was made on is nowhere at its address; what GDAL's file systems name may be.
    const bool relative = std::string_view(CPLGetXMLValue(&node, "relativeToVRT", "0")) == "1";
    if (!relative && path.starts_with('/') && !path.starts_with("/vsi"))
      return Problem{"raster-format-unsupported",
                     name_ + " names a file of the machine that it was made on, " + proto::shown_text(path),
                     "paths that count from the VRT, as gdalbuildvrt writes them for rasters beside it, or addresses", ""};
    if (path.empty()) return unsupported(name_, "a <SourceFilename> that names no raster");
    // GDAL would read the other one with what it names, which nobody has looked at.
    const std::string other = path.substr(0, path.find('?'));
    if (extension_of(other) == ".vrt") return vrt_in_vrt(name_, proto::shown_text(other.substr(other.rfind('/') + 1)));
    const auto [known, is_new] = numbers_.emplace(path, written_.size());
    if (is_new) written_.push_back(path);
    CPLSetXMLValue(&node, "", called_(known->second, path).c_str());
    CPLSetXMLValue(&node, "#relativeToVRT", "0");
    return {};
  }

  const std::string& name_;
  const std::function<std::string(std::size_t, const std::string&)>& called_;
  std::map<std::string, std::size_t> numbers_;
  std::vector<std::string> written_;
};

/// Overviews that are made of those of its rasters, where it has none of its own: without them a first picture reads all pixels.
void add_overviews(CPLXMLNode& root) {
  constexpr int kSmallest_px = 256;
  if (CPLSearchXMLNode(&root, "OverviewList") != nullptr || CPLSearchXMLNode(&root, "Overview") != nullptr) return;
  const auto side = [&](const char* name) { return std::atoi(CPLGetXMLValue(&root, name, "0")); };
  const int longest = std::max(side("rasterXSize"), side("rasterYSize"));
  std::string factors;
  for (int factor = 2; longest / factor >= kSmallest_px; factor *= 2)
    factors += (factors.empty() ? "" : " ") + std::to_string(factor);
  if (factors.empty()) return;
  CPLXMLNode* const list = CPLCreateXMLElementAndValue(&root, "OverviewList", factors.c_str());
  CPLAddXMLAttributeAndValue(list, "resampling", "NEAREST");
}

}  // namespace

Problem vrt_in_vrt(const std::string& name, const std::string& other) {
  return {"raster-format-unsupported", name + " names another VRT, " + other + ", and a VRT in a VRT is not read",
          "a VRT of rasters", ""};
}

proto::Result<VrtRasters> take_rasters(const std::string& text, const std::string& name,
                                       const std::function<std::string(std::size_t, const std::string&)>& called) {
  const GdalScope scope(Trust::posted_file);
  const Tree tree(CPLParseXMLString(text.c_str()));
  CPLXMLNode* const root = tree ? CPLGetXMLNode(tree.get(), "=VRTDataset") : nullptr;
  if (root == nullptr)
    return Problem{"raster-unreadable", name + " is a damaged VRT: " + scope.message("", name), "a complete, undamaged file", ""};
  Walk walk(name, called);
  if (auto done = walk.go(root->psChild); !done.ok()) return done.problem();
  VrtRasters found{walk.written(), ""};
  if (found.written.empty()) return unsupported(name, "no raster in it");
  add_overviews(*root);
  CPLXMLNode* const beside = std::exchange(root->psNext, nullptr);  // which the walk did not see
  const std::unique_ptr<char, decltype(&VSIFree)> out(CPLSerializeXMLTree(root), VSIFree);
  root->psNext = beside;
  found.text = out ? out.get() : "";
  return found;
}

}  // namespace cordillera::raster
