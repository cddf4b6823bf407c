#include "raster/open/raster_state.h"

#include <cpl_conv.h>
#include <cpl_minixml.h>
#include <gdal_priv.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string_view>
#include <vector>

#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/storage/ranged_file.h"
#include "raster/storage/storage.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> files_beside(const std::string& path) {
  std::vector<std::string> files = sides_of(path);
  files.push_back(path + ".msk");
  std::error_code error;
  std::erase_if(files, [&](const std::string& file) { return file == path || !fs::is_regular_file(file, error); });
  return files;
}

/// What GDAL finds in a VRT; no more than its name where it is none.
std::vector<std::string> files_in_vrt(const std::string& path) {
  const GdalScope scope(Trust::operator_file);
  const char* const drivers[] = {"VRT", nullptr};
  const std::unique_ptr<GDALDataset> vrt(
      GDALDataset::FromHandle(GDALOpenEx(path.c_str(), GDAL_OF_RASTER, drivers, nullptr, nullptr)));
  std::vector<std::string> files;
  if (vrt == nullptr) return files;
  const std::unique_ptr<char*, decltype(&CSLDestroy)> list(vrt->GetFileList(), CSLDestroy);
  for (char** file = list.get(); file != nullptr && *file != nullptr; ++file) files.emplace_back(*file);
  return files;
}

/// Of a PAM file: elements that hold others, and those that change where a raster lies or what its heights are.
constexpr std::array<std::string_view, 4> kHolders{"PAMDataset", "Subdataset", "PAMRasterBand", "Metadata"};
constexpr std::array<std::string_view, 11> kRead{"SRS",   "GeoTransform", "GCPList",     "GeodataXform", "NoDataValue", "Offset",
                                                 "Scale", "UnitType",     "Description", "ColorInterp",  "ColorTable"};
/// Of the items of metadata those that something here asks for. GDAL writes all that a driver tells next to its statistics.
constexpr std::array<std::string_view, 8> kReadItems{"AREA_OR_POINT", "PIXELTYPE",     "NETCDF_VARNAME", "positive",
                                                     "standard_name", "missing_value", "valid_min",      "valid_max"};

/// "lat#units": coordinates of a NetCDF file in degrees.
bool is_read_item(std::string_view key) {
  return std::ranges::find(kReadItems, key) != kReadItems.end() || key.ends_with("#units") || key.ends_with("#long_name");
}

/// Statistics, histograms and what viewers keep in domains of their own change no tile.
bool is_read(const CPLXMLNode& node) {
  if (node.eType == CXT_Attribute || node.eType == CXT_Text) return true;
  if (node.eType != CXT_Element) return false;
  const std::string_view name = node.pszValue;
  const auto attribute = [&](const char* of) { return std::string_view(CPLGetXMLValue(&node, of, "")); };
  if (name == "MDI") return is_read_item(attribute("key"));
  if (name == "Metadata") return attribute("domain").empty() || attribute("domain") == "IMAGE_STRUCTURE";
  return std::ranges::find(kHolders, name) != kHolders.end() || std::ranges::find(kRead, name) != kRead.end();
}

/// Takes everything else out. False: nothing is left.
bool keep_what_is_read(CPLXMLNode& holder) {
  bool any = false;
  for (CPLXMLNode *child = holder.psChild, *next = nullptr; child != nullptr; child = next) {
    next = child->psNext;
    const bool element = child->eType == CXT_Element;
    const bool holds = element && std::ranges::find(kHolders, child->pszValue) != kHolders.end();
    if (is_read(*child) && (!holds || keep_what_is_read(*child))) {
      any |= element;
    } else {
      CPLRemoveXMLChild(&holder, child);
      CPLDestroyXMLNode(child);
    }
  }
  return any;
}

/// Whether the raster or band says the same without its notes.
bool is_own(GDALMajorObject& own, const CPLXMLNode& said, const CPLXMLNode& holder) {
  const std::string_view name = said.pszValue, text = CPLGetXMLValue(&said, "", "");
  if (name == "Description") return text == own.GetDescription();
  if (name != "MDI") return false;
  const char* const item = own.GetMetadataItem(CPLGetXMLValue(&said, "key", ""), CPLGetXMLValue(&holder, "domain", ""));
  return item != nullptr && text == item;
}

/// Takes out what a raster, or of it the band, says itself: GDAL repeats that in its notes as soon as it keeps statistics there.
void leave_out_own(CPLXMLNode& holder, GDALDataset& raster, GDALMajorObject& own) {
  for (CPLXMLNode *child = holder.psChild, *next = nullptr; child != nullptr; child = next) {
    next = child->psNext;
    if (child->eType != CXT_Element) continue;
    const std::string_view name = child->pszValue;
    if (name == "Metadata") leave_out_own(*child, raster, own);
    if (name == "PAMRasterBand") {
      GDALRasterBand* const band = raster.GetRasterBand(std::atoi(CPLGetXMLValue(child, "band", "0")));
      if (band != nullptr) leave_out_own(*child, raster, *band);
    }
    if (!is_own(own, *child, holder)) continue;
    CPLRemoveXMLChild(&holder, child);
    CPLDestroyXMLNode(child);
  }
}

void leave_out_own(CPLXMLNode& said, const std::string& path) {
  // Opening may read a whole file of text.
  if (CPLSearchXMLNode(&said, "Description") == nullptr && CPLSearchXMLNode(&said, "MDI") == nullptr) return;
  const CPLConfigOptionSetter without_notes("GDAL_PAM_ENABLED", "NO", false);
  const std::vector<const char*> drivers = extension_of(path) == ".hgt" ? std::vector<const char*>{"SRTMHGT", nullptr}
                                                                        : allowed_drivers(path, Trust::operator_file, false);
  const GDALDatasetUniquePtr raster(
      GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers.data(), nullptr, nullptr));
  if (raster) leave_out_own(said, *raster, *raster);
}

/// What is read of the notes beside a raster and not said by itself; empty: nothing, as of a raster without any.
std::string said_beside(const std::string& path) {
  const std::string pam = pam_of(path);
  std::error_code error;
  if (!fs::is_regular_file(pam, error)) return "";
  const GdalScope scope(Trust::operator_file);  // GDAL passes over one that is no XML, too
  const CPLXMLTreeCloser tree(CPLParseXMLFile(pam.c_str()));
  CPLXMLNode* const said = CPLGetXMLNode(tree.get(), "=PAMDataset");
  if (said == nullptr || !keep_what_is_read(*said)) return "";
  leave_out_own(*said, path);
  if (!keep_what_is_read(*said)) return "";
  const std::unique_ptr<char, decltype(&VSIFree)> text(CPLSerializeXMLTree(said), VSIFree);
  return text.get();
}

/// FNV-1a, 64 bits: http://www.isthe.com/chongo/tech/comp/fnv
std::string hash_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const unsigned char c : text) hash = (hash ^ c) * 0x100000001b3;
  return std::to_string(hash);
}

/// With all of its parts: a VRT may name another.
void add_parts(const std::string& path, std::set<std::string>& parts) {
  if (!parts.insert(path).second || is_remote(path)) return;
  for (const std::string& file : files_beside(path)) parts.insert(file);
  if (extension_of(path) != ".vrt") return;
  for (const std::string& file : files_in_vrt(path)) add_parts(file, parts);
}

}  // namespace

std::string state_of_raster(const std::string& path, Trust trust) {
  std::string own = state_of(path);
  if (trust != Trust::operator_file || own.empty() || is_remote(path) || ranged_file(path) || is_vrt_of_ranged_files(path))
    return own;
  std::set<std::string> parts;
  add_parts(path, parts);
  // By names that are the same wherever the command is given.
  std::error_code error;
  const auto whole = [&](const std::string& name) { return fs::absolute(name, error).lexically_normal(); };
  const fs::path folder = whole(path).parent_path();
  std::map<std::string, std::string> states;  // by those names
  for (const std::string& part : parts) {
    const std::string name = whole(part).lexically_relative(folder).string();
    states[name] = state_of(part);
    if (const std::string said = said_beside(part); !said.empty()) states[pam_of(name)] = said;
  }
  if (states.size() == 1) return own;
  std::string all;
  for (const auto& [name, state] : states) all += name + "\n" + state + "\n";
  return own + ", and " + std::to_string(states.size() - 1) + (states.size() == 2 ? " file" : " files") +
         " with it: " + hash_of(all);
}

}  // namespace cordillera::raster
