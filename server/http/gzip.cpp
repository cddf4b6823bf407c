#include "server/http/gzip.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <optional>
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

/// What a coding is given, by its name or by *; nothing: it is not spoken of.
std::optional<double> quality_of(std::string_view accepted, std::string_view wanted) {
  std::optional<double> named, any;
  proto::each_part(accepted, ',', [&](std::string_view item) {
    const std::string_view coding = item.substr(0, item.find(';'));
    if (coding == wanted || (wanted == "gzip" && coding == "x-gzip")) named = quality(item);
    if (coding == "*") any = quality(item);
  });
  return named ? named : any;
}

}  // namespace

std::string coding_of(std::string_view content_encoding) {
  const std::string coding = proto::lower(content_encoding);
  return coding == "identity" ? "" : coding;
}

std::string_view preferred_coding(const Request& request, std::initializer_list<std::string_view> codings) {
  const auto header = request.header("accept-encoding");
  if (!header) return "";
  const std::string accepted = lower_without_spaces(*header);
  std::string_view best;
  // What is not named is taken last, unless * stands for it.
  double most = quality_of(accepted, "identity").value_or(std::numeric_limits<double>::min());
  for (auto coding = std::rbegin(codings); coding != std::rend(codings); ++coding) {
    const double q = quality_of(accepted, *coding).value_or(0);
    if (q > 0 && q >= most) best = *coding, most = q;
  }
  return best;
}

bool accepts_gzip(const Request& request) { return preferred_coding(request, {"gzip"}) == "gzip"; }

bool is_compressible(std::string_view type) {
  static constexpr std::string_view kTypes[] = {
      "text/",           "application/json", "application/geo+json",      "application/vnd.oai.openapi+json",
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
