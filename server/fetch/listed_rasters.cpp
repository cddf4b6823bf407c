#include "server/fetch/listed_rasters.h"

#include "proto/utf8.h"
#include "raster/storage/storage.h"
#include "server/datasets/dataset_folder.h"
#include "server/datasets/upload.h"
#include "server/fetch/addresses.h"
#include "server/http/digest.h"

namespace cordillera::server::updates {

namespace fs = std::filesystem;

std::string file_of(const proto::ListedRasters& listed, int number) {
  return std::to_string(number) + suffix_of(listed.rasters(number).name());
}

Print print_of(const proto::ListedRaster& raster) {
  const double bytes = raster.bytes();
  const bool is_size = bytes >= 0 && bytes <= 0x1p53;
  return {plain_header(raster.etag()), plain_header(raster.modified()), is_size ? static_cast<std::uint64_t>(bytes) : 0,
          raster.ranged()};
}

void set_print(const Print& print, proto::ListedRaster& raster) {
  raster.set_etag(proto::as_utf8(print.etag));
  raster.set_modified(proto::as_utf8(print.modified));
  raster.set_bytes(static_cast<double>(print.bytes));
  raster.set_ranged(print.ranged);
}

std::string state_of(const proto::ListedRaster& raster) { return digest(to_json_line(raster)); }

proto::Result<void> write_listed(const fs::path& folder, const proto::ListedRasters& listed) {
  if (raster::write_whole((folder / kListedFile).string(), to_json_line(listed) + "\n").ok()) return {};
  return proto::Problem{"storage-full", "the list of rasters cannot be written down", "trying again when there is room", ""};
}

std::optional<proto::ListedRasters> read_listed(const fs::path& folder) {
  const auto text = read_note(folder / kListedFile, 2 * kMostListed_bytes);
  proto::ListedRasters listed;
  if (!text || !from_json(*text, &listed) || listed.rasters_size() > kMostListed) return std::nullopt;
  for (proto::ListedRaster& raster : *listed.mutable_rasters()) raster.set_name(listed_name(raster.name()));
  return listed;
}

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
