#include "server/http/gzip.h"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>

#include "pipeline/exports/gzip.h"
#include "pipeline/faces/face.h"
#include "proto/letters.h"
#include "proto/parts.h"

namespace cordillera::server {
namespace {

std::string lower_without_spaces(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c != ' ' && c != '\t') out += proto::lower(c);
  }
  return out;
}

double quality(std::string_view item) {
  const auto mark = item.find(";q=");
  return mark == item.npos ? 1 : std::strtod(std::string(item.substr(mark + 3)).c_str(), nullptr);
}

}  // namespace

std::string coding_of(std::string_view content_encoding) {
  const std::string coding = proto::lower(content_encoding);
  return coding == "identity" ? "" : coding;
}

bool accepts_gzip(const Request& request) { return accepts(request, "gzip"); }

bool accepts(const Request& request, std::string_view wanted) {
  const auto header = request.header("accept-encoding");
  if (!header) return false;
  double named = -1, any = 0;
  proto::each_part(lower_without_spaces(*header), ',', [&](std::string_view item) {
    const std::string_view coding = item.substr(0, item.find(';'));
    if (coding == wanted || (wanted == "gzip" && coding == "x-gzip")) named = quality(item);
    if (coding == "*") any = quality(item);
  });
  return named >= 0 ? named > 0 : any > 0;
}

bool is_compressible(std::string_view type) {
  static constexpr std::string_view kTypes[] = {"text/",           "application/json", "application/geo+json",
                                                "application/xml", "image/svg+xml",    pipeline::faces::kVectorTile};
  const auto begins = [&](std::string_view kind) { return type.substr(0, kind.size()) == kind; };
  return !begins("text/event-stream") && std::any_of(std::begin(kTypes), std::end(kTypes), begins);
}

pipeline::faces::Document gzipped(const pipeline::faces::Terrain& terrain, const pipeline::faces::Document& plain) {
  const auto made = terrain.kept("gzip " + plain.etag, [&]() -> proto::Result<std::optional<pipeline::faces::Document>> {
    return std::optional(pipeline::faces::document(pipeline::exports::gzip(plain.bytes, pipeline::exports::kQuick)));
  });
  return **made;
}

}  // namespace cordillera::server
