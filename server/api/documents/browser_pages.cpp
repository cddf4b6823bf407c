#include "server/api/documents/browser_pages.h"

#include "pipeline/tileset/html_text.h"
#include "server/api/documents/openapi.h"
#include "server/http/json.h"

namespace cordillera::server {
namespace {

using pipeline::html_text;

std::string parameters_html(const Json& operation) {
  std::string out;
  for (const Json& parameter : operation.value("parameters", Json::array())) {
    if (!parameter.contains("name")) continue;
    out += "<tr><td><code>" + html_text(parameter["name"].get<std::string>()) + "</code></td><td>" +
           html_text(parameter.value("in", "")) + "</td><td>" + html_text(parameter.value("description", "")) + "</td></tr>\n";
  }
  const std::string head = "<tr><th>name</th><th>in</th><th>what it is</th></tr>\n";
  return out.empty() ? "" : "<details><summary>parameters</summary><table>" + head + out + "</table></details>\n";
}

std::string operation_html(const std::string& method, const std::string& path, const Json& operation) {
  std::string upper = method;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return "<h3><code>" + upper + " " + html_text(path) + "</code></h3>\n<p>" + html_text(operation.value("summary", "")) +
         "</p>\n" + parameters_html(operation);
}

std::string made_page() {
  const Json paths = openapi::all_paths(Tokens::none);
  std::string out =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>Cordillera: API</title>\n"
      "<style>body{font:1rem/1.5 system-ui,sans-serif;max-width:60rem;margin:auto;padding:1rem;color-scheme:light "
      "dark}th,td{vertical-align:top;text-align:left;padding:0 1rem 0 0}h3,td{overflow-wrap:anywhere}td{min-width:4rem}"
      "</style></head><body>\n<h1>Cordillera " CORDILLERA_VERSION
      "</h1>\n<p>Post an elevation model, fetch terrain tiles. For programs: <a href=\"api\">OpenAPI</a>. "
      "To look at: <a href=\"./\">the viewer</a>.</p>\n";
  for (const char* tag :
       {"datasets", "uploads", "tiles", "meshes", "heights", "sources", "versions", "live", "stac", "service"}) {
    out += std::string("<h2>") + tag + "</h2>\n";
    for (const auto& [path, item] : paths.items()) {
      for (const auto& [method, operation] : item.items()) {
        if (operation.is_object() && operation.contains("tags") && operation["tags"][0] == tag)
          out += operation_html(method, path, operation);
      }
    }
  }
  return out + "</body></html>\n";
}

/// 16 x 16 pixels of one bit: a palette of sky and rock, rows from the bottom.
std::string made_icon() {
  constexpr int kSide = 16, kRowBytes = 4, kBitmap = 40 + 8 + 2 * kSide * kRowBytes;
  std::string out;
  const auto put = [&out](std::uint32_t value, int bytes) {
    for (int k = 0; k < bytes; ++k) out += static_cast<char>(value >> (8 * k) & 255);
  };
  for (const std::uint32_t word : {0u, 1u, 1u}) put(word, 2);  // an icon, one picture
  for (const std::uint32_t byte : {16u, 16u, 2u, 0u}) put(byte, 1);
  put(1, 2), put(1, 2), put(kBitmap, 4), put(22, 4);
  put(40, 4), put(kSide, 4), put(2 * kSide, 4), put(1, 2), put(1, 2), put(0, 4), put(0, 4), put(0, 4), put(0, 4), put(2, 4),
      put(0, 4);
  put(0xe8f0f6, 4), put(0x35546b, 4);
  for (int row = 0; row < kSide; ++row) {
    std::uint32_t bits = 0;
    for (int column = 0; column < kSide; ++column) {
      const bool rock = row <= 13 - 2 * std::abs(column - 6) || row <= 9 - 2 * std::abs(column - 11) || row < 2;
      bits = bits << 1 | (rock ? 1u : 0u);
    }
    put(bits >> 8, 1), put(bits & 255, 1), put(0, 2);
  }
  return out + std::string(kSide * kRowBytes, '\0');  // nothing is transparent
}

Response kept(const char* type, const std::string& body) {
  Response response;
  response.set("Content-Type", type);
  response.set("Cache-Control", "public, max-age=86400");
  response.body = body;
  return response;
}

}  // namespace

Response version_document() {
  Response response = json_response(200, {{"name", "Cordillera"}, {"version", CORDILLERA_VERSION}});
  response.set("Cache-Control", "no-cache");
  return response;
}

Response docs_page() {
  static const std::string kPage = made_page();
  return kept("text/html; charset=utf-8", kPage);
}

Response icon() {
  static const std::string kIcon = made_icon();
  return kept("image/x-icon", kIcon);
}

}  // namespace cordillera::server
