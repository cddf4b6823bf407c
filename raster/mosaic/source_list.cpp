#include "raster/mosaic/source_list.h"

#include <cpl_json.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <sstream>

#include "proto/numbers.h"
#include "proto/utf8.h"
#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/mosaic/folder_files.h"
#include "raster/storage/storage.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;
using Sources = std::vector<ListedSource>;
using Listed = proto::Result<Sources>;

template <std::size_t N>
bool is_one_of(const std::string& text, const std::array<const char*, N>& words) {
  return std::find(words.begin(), words.end(), text) != words.end();
}

proto::Problem invalid(const std::string& list, const std::string& what) {
  return {"sources-invalid", list + " " + what,
          "a raster; or of several a folder, a text with a path in each line, a tile index as gdaltindex makes it, or STAC items",
          ""};
}

/// As GDAL addresses it; a plain relative path counts from the list.
std::string resolved(const std::string& path, const std::string& list) {
  constexpr std::array<std::pair<const char*, const char*>, 5> kSchemes{{{"s3://", "/vsis3/"},
                                                                         {"gs://", "/vsigs/"},
                                                                         {"az://", "/vsiaz/"},
                                                                         {"https://", "/vsicurl/https://"},
                                                                         {"http://", "/vsicurl/http://"}}};
  for (const auto& [scheme, prefix] : kSchemes) {
    if (path.rfind(scheme, 0) == 0) return prefix + path.substr(std::string(scheme).size());
  }
  if (path.rfind("file://", 0) == 0) return path.substr(7);
  if (path.empty() || path.front() == '/') return path;
  const std::string folder = fs::path(list).parent_path().string();
  return folder.empty() ? path : folder + "/" + path;
}

/// The escapes of an address (RFC 3986, 2.1) as what they mean. What is none stays, and so does "%00", which is in no name.
std::string unescaped(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const bool escape = text[at] == '%' && at + 2 < text.size();
    const auto byte = escape ? proto::number<unsigned char>(std::string_view(text).substr(at + 1, 2), 16) : std::nullopt;
    const bool meant = byte && *byte != 0;
    out += meant ? static_cast<char>(*byte) : text[at];
    if (meant) at += 2;
  }
  return out;
}

/// "old%20sheet.tif" as "old sheet.tif" where that is the file: STAC writes addresses, not paths.
std::string unescaped_where_there(const std::string& path) {
  std::error_code error;
  if (path.find('%') == path.npos || is_remote(path) || fs::exists(path, error)) return path;
  const std::string meant = unescaped(path);
  return fs::exists(meant, error) ? meant : path;
}

/// Archives too: collections are kept as they were fetched.
bool is_listed(const std::string& extension) {
  return is_raster_extension(extension) || extension == ".zip" || extension == ".gz";
}

/// Whether a text is points (XYZ), as its first line or, below their names, its second one shows: three numbers.
bool holds_points(const std::string& text) {
  const auto begins_with_numbers = [](std::string line) {
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
    std::istringstream words(line);
    double x = 0, y = 0, z = 0;
    return static_cast<bool>(words >> x >> y >> z);
  };
  std::istringstream lines(text);
  std::string first, second;
  std::getline(lines, first);
  std::getline(lines, second);
  return begins_with_numbers(first) || begins_with_numbers(second);
}

/// A raster that is called as a text: a zero byte is in no list.
bool is_no_text(const std::string& head) { return head.find('\0') != std::string::npos; }

constexpr std::uint64_t kHead_bytes = 4096;

std::string_view without_mark(std::string_view text) {
  return text.starts_with(proto::kUtf8Mark) ? text.substr(proto::kUtf8Mark.size()) : text;
}

/// Its first bytes; none of a file that cannot be read.
std::string text_head(const std::string& path) {
  const auto head = read_range(path, 0, kHead_bytes);
  return head.ok() && *head ? std::string(without_mark(**head)) : "";
}

/// Of a folder, those that hold points: texts of a name that may be anything.
std::vector<std::string> texts_of_points(const std::string& folder) {
  constexpr std::array kAnything{".txt", ".csv"};
  std::vector<std::string> texts;
  const auto files = files_below(folder);
  if (!files) return texts;
  for (const std::string& path : *files) {
    if (!is_one_of(extension_of(path), kAnything)) continue;
    if (const std::string head = text_head(path); !is_no_text(head) && holds_points(head)) texts.push_back(path);
  }
  return texts;
}

Listed in_folder(const std::string& folder) {
  Sources sources;
  const auto files = files_below(folder);
  if (!files) return files.problem();
  for (const std::string& path : *files) {
    const std::string extension = extension_of(path);
    std::error_code error;
    if (is_listed(extension))
      sources.push_back({path, {}});
    else if (extension.empty() && !fs::exists(path, error))  // of rasters, most likely: on a disk that is not there now
      return proto::Problem{"file-unreadable", path + " is a link to what is not there", "a folder whose links lead to something",
                            ""};
  }
  if (const auto texts = sources.empty() ? note_on_texts(folder) : std::nullopt)
    return proto::Problem{"sources-invalid", folder + " has no raster in it that is called as one; " + *texts,
                          "the texts by their names, where each is a grid, such as " + folder + "/*.txt", ""};
  if (sources.empty())
    return proto::Problem{"sources-invalid", folder + " has no raster in it",
                          "a folder with files that end in " + raster_extensions() + " .zip or .gz", ""};
  return sources;
}

/// Words of a line; one in double quotes may hold spaces.
std::vector<std::string> words_of(const std::string& line) {
  std::vector<std::string> words;
  std::string word;
  bool quoted = false, any = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
      any = true;
    } else if (!quoted && (c == ' ' || c == '\t' || c == '\r')) {
      if (any) words.push_back(word);
      word.clear();
      any = false;
    } else {
      if (c == '#' && !quoted && !any) return words;
      word += c;
      any = true;
    }
  }
  if (any) words.push_back(word);
  return words;
}

Listed in_text(const std::string& list, const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != text.npos && text[first] == '<') return invalid(list, "is a page or another XML text, not a list of rasters");
  Sources sources;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::vector<std::string> words = words_of(line);
    if (words.empty()) continue;
    ListedSource source{words.front(), {}};
    for (std::size_t k = 1; k < words.size(); ++k) {
      const std::size_t equals = words[k].find('=');
      if (equals == std::string::npos)
        return invalid(list, "line " + std::to_string(number) + ": word " + std::to_string(k + 1) + " is no option=value");
      source.options.emplace_back(words[k].substr(0, equals), words[k].substr(equals + 1));
    }
    sources.push_back(std::move(source));
  }
  if (sources.empty()) return invalid(list, "names no raster");
  return sources;
}

bool has_role(const CPLJSONObject& asset, std::string_view wanted) {
  const CPLJSONArray roles = asset.GetArray("roles");
  for (int k = 0; roles.IsValid() && k < roles.Size(); ++k) {
    if (roles[k].ToString() == wanted) return true;
  }
  return false;
}

/// A picture or a text about the heights, which may be a GeoTIFF too.
bool is_beside_the_data(const CPLJSONObject& asset) {
  return has_role(asset, "thumbnail") || has_role(asset, "overview") || has_role(asset, "metadata");
}

/// The asset that holds the heights.
std::string asset_of(const CPLJSONObject& item) {
  const CPLJSONObject assets = item["assets"];
  if (!assets.IsValid()) return "";
  std::string first;
  for (const CPLJSONObject& asset : assets.GetChildren()) {
    const std::string href = asset.GetString("href"), type = asset.GetString("type");
    if (has_role(asset, "data")) return href;
    const bool tiff = type.rfind("image/tiff", 0) == 0 || extension_of(href) == ".tif" || extension_of(href) == ".tiff";
    if (first.empty() && tiff && !is_beside_the_data(asset)) first = href;
  }
  return first;
}

Listed in_stac(const std::string& list, const std::vector<CPLJSONObject>& items) {
  Sources sources;
  for (const CPLJSONObject& item : items) {
    const std::string href = asset_of(item);
    if (href.empty())
      return invalid(list, "item \"" + proto::shown_text(item.GetString("id")) +
                               "\" has no asset with the role \"data\" and no GeoTIFF but thumbnails, overviews and metadata");
    sources.push_back({href, {}});
  }
  if (sources.empty()) return invalid(list, "has no items");
  return sources;
}

Listed in_json(const std::string& list, const std::string& text) {
  CPLJSONDocument document;
  if (!document.LoadMemory(text)) return invalid(list, "is not JSON");
  if (text.find("\\u0000") != text.npos) return invalid(list, "has the character 0, where every name would end");
  const CPLJSONObject root = document.GetRoot();
  if (root.GetString("type") == "FeatureCollection") {
    const CPLJSONArray features = root.GetArray("features");
    std::vector<CPLJSONObject> items;
    for (int k = 0; features.IsValid() && k < features.Size(); ++k) items.push_back(features[k]);
    return in_stac(list, items);
  }
  if (root.GetString("type") == "Feature") return in_stac(list, {root});
  const CPLJSONArray members = root.GetArray("sources");
  if (!members.IsValid()) return invalid(list, "has neither \"sources\" nor STAC items");
  Sources sources;
  for (int k = 0; k < members.Size(); ++k) {
    ListedSource source{members[k].GetString("path"), {}};
    if (source.path.empty()) return invalid(list, "source " + std::to_string(k) + " has no path");
    for (const CPLJSONObject& value : members[k].GetChildren()) {
      if (value.GetName() != "path") source.options.emplace_back(value.GetName(), value.ToString());
    }
    sources.push_back(std::move(source));
  }
  if (sources.empty()) return invalid(list, "names no raster");
  return sources;
}

/// A GeoPackage may hold both: rasters go before outlines of rasters. One with neither is damaged: it is told so as the raster
/// that it was.
bool lists_rasters(const std::string& geopackage) {
  const auto opened = [&](unsigned kind) {
    const char* const only[] = {"GPKG", nullptr};
    return GDALDatasetUniquePtr(GDALDataset::Open(geopackage.c_str(), kind | GDAL_OF_READONLY, only, nullptr, nullptr));
  };
  if (opened(GDAL_OF_RASTER)) return false;
  const auto index = opened(GDAL_OF_VECTOR);
  return index && index->GetLayerCount() > 0;
}

/// list: what it is called.
Listed in_index(const std::string& path, const std::string& list, const GdalScope& scope) {
  static constexpr const char* kDrivers[] = {"GeoJSON", "GPKG", "ESRI Shapefile", nullptr};
  if (!size_of(path)) return invalid(list, "does not exist");
  const GDALDatasetUniquePtr index(
      GDALDataset::Open(path.c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY, kDrivers, nullptr, nullptr));
  if (!index || index->GetLayerCount() == 0)
    return invalid(list, "cannot be opened as a tile index: " + scope.message(path, list));
  OGRLayer* const layer = index->GetLayer(0);
  const int field = layer->GetLayerDefn()->GetFieldIndex("location");
  if (field < 0) return invalid(list, "has no field \"location\", which a tile index has");
  Sources sources;
  for (const auto& feature : *layer) sources.push_back({feature->GetFieldAsString(field), {}});
  if (sources.empty()) return invalid(list, "names no raster");
  return sources;
}

constexpr std::array kTexts{".txt", ".lst"}, kIndices{".gpkg", ".shp"};

/// A file of this machine, or elsewhere, that is a list by its name; json: by its bytes, whatever its name. None: it is a raster.
struct ListFile {
  std::string path, name;
  bool json = false;
};

Listed in_file(const ListFile& list, const GdalScope& scope) {
  const std::string extension = list.json ? ".json" : extension_of(list.name);
  const bool geojson = extension == ".geojson", text = is_one_of(extension, kTexts);
  if (is_one_of(extension, kIndices)) {
    if (extension == ".gpkg" && !lists_rasters(list.path)) return Sources();
    return in_index(list.path, list.name, scope);
  }
  if (!text && !geojson && extension != ".json") return Sources();
  if (text) {  // before all of it: points may be many
    if (const std::string head = text_head(list.path); is_no_text(head) || holds_points(head)) return Sources();
  }
  const auto bytes = read_whole(list.path);
  if (!bytes.ok()) return bytes.problem();
  if (!*bytes) return invalid(list.name, "does not exist");
  // STAC items and tile indices are both GeoJSON.
  const bool index = geojson || (list.json && (*bytes)->find("\"FeatureCollection\"") != std::string::npos);
  if (index && (*bytes)->find("\"assets\"") == std::string::npos) return in_index(list.path, list.name, scope);
  const std::string words(without_mark(**bytes));
  return text ? in_text(list.name, words) : in_json(list.name, words);
}

}  // namespace

Listed list_sources(const std::string& word) {
  std::error_code error;
  if (!is_remote(word) && fs::is_directory(word, error)) return in_folder(word);
  const GdalScope scope(Trust::operator_file);
  auto listed = in_file({word, word}, scope);
  if (!listed) return listed;
  if (listed->empty()) return Sources{{resolved(word, ""), {}}};
  for (ListedSource& source : *listed) source.path = unescaped_where_there(resolved(source.path, word));
  return listed;
}

std::optional<std::string> note_on_texts(const std::string& word) {
  std::error_code error;
  if (is_remote(word) || !fs::is_directory(word, error)) return std::nullopt;
  const GdalScope scope(Trust::operator_file);
  const std::vector<std::string> texts = texts_of_points(word);
  if (texts.empty()) return std::nullopt;
  const std::string first = proto::as_utf8(fs::path(texts.front()).filename().string());
  return (texts.size() == 1 ? first + " looks like points and was"
                            : std::to_string(texts.size()) + " texts, such as " + first + ", look like points and were") +
         " not taken with the folder; named by itself a text of points is a raster";
}

ListKind list_kind(std::string_view head, const std::string& name) {
  // Blanks, and the mark that editors write before a text.
  const auto skip = [&](const char* these) { head.remove_prefix(std::min(head.find_first_not_of(these), head.size())); };
  skip(" \t\r\n\xef\xbb\xbf");
  if (head.starts_with('{')) return ListKind::list;
  if (head.starts_with("<?xml")) {
    head.remove_prefix(std::min(head.find("?>"), head.size()));
    skip("?> \t\r\n");
  }
  if (head.starts_with("<VRTDataset")) return ListKind::vrt;
  const std::string extension = extension_of(name);
  return is_one_of(extension, kTexts) || extension == ".gpkg" ? ListKind::list : ListKind::none;
}

Listed written_in(const std::string& path, const std::string& name) {
  const GdalScope scope(Trust::posted_file);
  const std::string extension = extension_of(name);
  return in_file({path, name, !is_one_of(extension, kTexts) && extension != ".gpkg"}, scope);
}

}  // namespace cordillera::raster
