#include "server/fetch/listed_rasters.h"

#include <fstream>

#include "proto/files.h"
#include "proto/utf8.h"
#include "raster/disk/write_all.h"
#include "server/datasets/upload.h"
#include "server/fetch/addresses.h"

namespace cordillera::server::updates {
namespace {

namespace fs = std::filesystem;
constexpr const char* kNote = "list.json";

/// nullopt: it is not as we write it.
std::optional<ListedRaster> raster_in(const Json& note) {
  const auto print = print_in(note);
  if (!print) return std::nullopt;
  ListedRaster raster{note.value("address", ""), listed_name(note.value("name", "")), {}, *print};
  if (!from_json(note.value("options", "{}"), &raster.options)) return std::nullopt;
  return raster;
}

}  // namespace

std::string file_of(const ListedRasters& listed, std::size_t number) {
  return std::to_string(number) + suffix_of(listed.rasters[number].name);
}

proto::Result<void> write_listed(const fs::path& folder, const ListedRasters& listed) {
  Json note = {{"vrt", listed.vrt}, {"rasters", Json::array()}};
  for (const ListedRaster& raster : listed.rasters) {
    Json one = print_json(raster.print);
    one["address"] = raster.address;
    one["name"] = raster.name;
    one["options"] = to_json_line(raster.options);
    note["rasters"].push_back(std::move(one));
  }
  if (raster::write_whole((folder / kNote).string(), note.dump(1, ' ', false, Json::error_handler_t::replace) + "\n").ok())
    return {};
  return proto::Problem{"storage-full", "the list of rasters cannot be written down", "trying again when there is room", ""};
}

std::optional<ListedRasters> read_listed(const fs::path& folder) try {
  constexpr std::uintmax_t kLargest_bytes = std::uintmax_t{32} << 20;
  const fs::path path = folder / kNote;
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(path, error)) || fs::file_size(path, error) > kLargest_bytes) return std::nullopt;
  const Json note = Json::parse(proto::bytes_of_file(path).value_or(""), nullptr, false);
  if (!note.is_object() || !note.contains("rasters") || !note["rasters"].is_array()) return std::nullopt;
  ListedRasters listed{note.value("vrt", false), {}};
  for (const Json& one : note["rasters"]) {
    auto raster = raster_in(one);
    if (!raster || listed.rasters.size() == kMostListed) return std::nullopt;
    listed.rasters.push_back(std::move(*raster));
  }
  return listed;
} catch (const Json::exception&) {  // of other types than we wrote
  return std::nullopt;
}

std::string listed_state(const fs::path& folder) { return proto::bytes_of_file(folder / kNote).value_or(""); }

std::string listed_address(const std::string& list, const std::string& written) {
  constexpr std::string_view kCurl = "/vsicurl/", kS3 = "/vsis3/";
  if (written.starts_with(kCurl)) return written.substr(kCurl.size());
  if (written.starts_with(kS3)) return "s3://" + written.substr(kS3.size());
  return resolved(list, written);
}

std::string listed_name(const std::string& written) {
  constexpr std::size_t kLongest = 200;
  const std::string path = without_query(written), name = path.substr(path.rfind('/') + 1);
  const bool plain = !name.empty() && name.size() <= kLongest && name != "." && name != "..";
  return plain ? proto::shown_text(name) : "raster";
}

}  // namespace cordillera::server::updates
