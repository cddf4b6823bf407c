// Which of a file's rasters and bands holds the heights.
#include <cpl_string.h>

#include <algorithm>
#include <array>
#include <functional>

#include "proto/letters.h"
#include "proto/numbers.h"
#include "proto/utf8.h"
#include "raster/gdal/formats.h"
#include "raster/open/dataset.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

/// What elevation models call their heights. Depths count downwards: whoever wants them says so.
constexpr std::array kHeightNames{"elevation", "z", "height", "altitude", "topo", "topography", "dem", "dtm", "dsm", "band1"};

/// One of several rasters of a NetCDF file or GeoPackage.
struct Subdataset {
  std::string address;  ///< for GDAL's Open
  std::string name;     ///< of the variable or table
};

std::vector<Subdataset> parts_of(GDALDataset& dataset) {
  std::vector<Subdataset> parts;
  char** const list = dataset.GetMetadata("SUBDATASETS");
  for (int k = 1; const char* address = CSLFetchNameValue(list, CPLSPrintf("SUBDATASET_%d_NAME", k)); ++k) {
    const std::string text = address;
    parts.push_back({text, text.substr(text.rfind(':') + 1)});
  }
  return parts;
}

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + proto::shown_text(name, 40);
  return proto::shown_text(list);
}

/// The one that was asked for, else the only one that is called as heights are.
proto::Result<Subdataset> chosen(const std::vector<Subdataset>& parts, const std::string& name, const std::string& asked) {
  std::vector<const Subdataset*> heights, alike;
  std::vector<std::string> names;
  for (const Subdataset& part : parts) {
    if (!asked.empty() && part.name == asked) return part;
    if (!asked.empty() && proto::same_letters(part.name, asked)) alike.push_back(&part);
    if (names_heights(part.name)) heights.push_back(&part);
    names.push_back(part.name);
  }
  if (alike.size() == 1) return *alike.front();
  if (asked.empty() && heights.size() == 1) return *heights.front();
  const std::string holds = name + " holds " + std::to_string(parts.size()) + " rasters, " + listed(names);
  return Problem{
      "raster-bands",
      holds + (asked.empty() ? ", and none alone is called as heights are" : "; none of them is " + proto::shown_text(asked)),
      "band= with the name of one of them", "band"};
}

/// Of a band that has one: what it was described as, or the NetCDF variable that it is of.
std::string name_of(GDALRasterBand& band) {
  const char* variable = band.GetMetadataItem("NETCDF_VARNAME");
  return variable != nullptr ? variable : band.GetDescription();
}

bool has_band(GDALDataset& dataset, const std::string& asked) {
  for (int k = 1; k <= dataset.GetRasterCount(); ++k)
    if (proto::same_letters(name_of(*dataset.GetRasterBand(k)), asked)) return true;
  return false;
}

/// The only band whose name is as wanted; 0: there is none, or more than one.
int only_band(GDALDataset& dataset, const std::function<bool(const std::string&)>& wanted) {
  int found = 0;
  for (int k = 1; k <= dataset.GetRasterCount(); ++k) {
    if (!wanted(name_of(*dataset.GetRasterBand(k)))) continue;
    if (found != 0) return 0;
    found = k;
  }
  return found;
}

/// 0: there is no such band, or more than one of that name, as those of a NetCDF variable with a time are.
int number_of(GDALDataset& dataset, const std::string& asked) {
  const int bands = dataset.GetRasterCount();
  if (const auto number = proto::number<int>(asked)) return *number >= 1 && *number <= bands ? *number : 0;
  if (const int exact = only_band(dataset, [&](const std::string& name) { return name == asked; })) return exact;
  return only_band(dataset, [&](const std::string& name) { return proto::same_letters(name, asked); });
}

/// The one that is called as heights are, where a file has several. "Band1" says nothing of a band.
int named_as_heights(GDALDataset& dataset) {
  return only_band(dataset, [](const std::string& name) { return names_heights(name) && proto::lower(name) != "band1"; });
}

/// "red" of a band that a picture has for that; empty: it is none.
std::string colour_of(GDALRasterBand& band) {
  switch (band.GetColorInterpretation()) {
    case GCI_RedBand: return "red";
    case GCI_GreenBand: return "green";
    case GCI_BlueBand: return "blue";
    default: return "";
  }
}

/// Colours are whole numbers; a picture whose bands do not say that they are some has three or four of bytes.
bool is_picture(GDALDataset& handle) {
  const int bands = handle.GetRasterCount();
  if (bands < 3) return false;
  bool bytes = bands <= 4, coloured = true;
  for (int k = 1; k <= bands; ++k) {
    GDALRasterBand& band = *handle.GetRasterBand(k);
    const GDALDataType type = band.GetRasterDataType();
    bytes = bytes && type == GDT_Byte && !names_heights(name_of(band));
    if (k <= 3) coloured = coloured && (type == GDT_Byte || type == GDT_UInt16) && !colour_of(band).empty();
  }
  return coloured || bytes;
}

Problem is_a_picture(const std::string& name, int bands) {
  const std::string file = shell_word(name);
  return {"raster-bands",
          name + " is a picture of " + std::to_string(bands) + " bands: its pixels are colours, which are no heights",
          "heights, such as the elevation model that the picture was made from; if it is Terrain-RGB, this gives them back: "
          "gdal_calc.py -R " +
              file + " -G " + file + " -B " + file +
              " --R_band=1 --G_band=2 --B_band=3 --type=Float32 --calc='-10000 + (R*65536. + G*256. + B) * 0.1' "
              "--outfile=heights.tif; band= with a number takes one of them all the same",
          "band"};
}

Problem no_such_band(const Dataset& dataset, const std::string& asked) {
  constexpr int kNamed = 10;
  const int bands = dataset.handle->GetRasterCount();
  std::vector<std::string> names;
  bool named = false, tells = false;  // names, and one that one band alone has
  for (int k = 1; k <= std::min(bands, kNamed); ++k) {
    const std::string name = name_of(*dataset.handle->GetRasterBand(k));
    named |= !name.empty();
    tells |= !name.empty() && only_band(*dataset.handle, [&](const std::string& other) { return other == name; }) != 0;
    names.push_back(std::to_string(k) + (name.empty() ? "" : " " + name));
  }
  const std::string has = dataset.name + " has " + std::to_string(bands) + (bands == 1 ? " band" : " bands") +
                          (named ? " (" + listed(names) + ")" : "");
  const std::string which =
      bands == 1 ? "band=1" : "band= with a number from 1 to " + std::to_string(bands) + (tells ? ", or a band's name" : "");
  const bool several = has_band(*dataset.handle, asked);
  const std::string why =
      asked.empty() ? "; an elevation model has one"
                    : (several ? ", and more than one is called " : ", and none of them is ") + proto::shown_text(asked);
  return {"raster-bands", has + why, which, "band"};
}

}  // namespace

bool names_heights(const std::string& name) {
  return std::find(kHeightNames.begin(), kHeightNames.end(), proto::lower(name)) != kHeightNames.end();
}

proto::Result<void> choose_raster(Dataset& dataset, const std::string& asked) {
  const std::vector<Subdataset> parts = parts_of(*dataset.handle);
  // Overviews of a COG, pages of a TIFF: a raster that can be read at once is the one.
  if (dataset.handle->GetRasterCount() > 0 || parts.empty()) return {};
  const auto part = chosen(parts, dataset.name, asked);
  if (!part) return part.problem();
  const char* const only[] = {dataset.handle->GetDriverName(), nullptr};
  dataset.handle.reset(GDALDataset::Open(part->address.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, only, nullptr, nullptr));
  if (!dataset.handle || dataset.handle->GetRasterCount() == 0)
    return Problem{"raster-format-unsupported", part->name + " of " + dataset.name + " cannot be opened as a raster",
                   accepted_formats(dataset.name), "band"};
  dataset.part = part->name;
  return {};
}

proto::Result<void> choose_band(Dataset& dataset, const std::string& asked) {
  GDALDataset& handle = *dataset.handle;
  const int bands = handle.GetRasterCount();
  const bool alpha = bands == 2 && handle.GetRasterBand(2)->GetColorInterpretation() == GCI_AlphaBand;
  int number = bands == 1 || alpha ? 1 : named_as_heights(handle);
  const bool part = proto::same_letters(asked, dataset.part);
  if (!asked.empty() && !part) number = number_of(handle, asked);
  const bool picture = is_picture(handle);
  if (number == 0 && picture && (part || asked.empty())) return is_a_picture(dataset.name, bands);
  if (number == 0) return no_such_band(dataset, part ? "" : asked);
  dataset.band = handle.GetRasterBand(number);
  if (picture) dataset.colour = colour_of(*dataset.band).empty() ? "colour" : colour_of(*dataset.band);
  const int flags = dataset.band->GetMaskFlags();
  // A band's own value that means no data is looked for in the pixels. The values of NODATA_VALUES, one for each band, GDAL alone
  // compares: it gives a mask of all bands.
  const bool by_own_value = (flags & GMF_NODATA) != 0 && (flags & GMF_PER_DATASET) == 0;
  if (alpha || !(by_own_value || (flags & GMF_ALL_VALID) != 0))
    dataset.mask = alpha ? handle.GetRasterBand(2) : dataset.band->GetMaskBand();
  return {};
}

}  // namespace cordillera::raster
