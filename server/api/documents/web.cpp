#include "server/api/documents/web.h"

#include <filesystem>

#include "pipeline/tileset/html_text.h"
#include "proto/paths.h"
#include "server/access/safe_headers.h"
#include "server/http/gzip.h"
#include "server/http/json.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

const char* content_type(const fs::path& path) {
  static const std::pair<const char*, const char*> types[] = {{".html", "text/html; charset=utf-8"},
                                                              {".js", "text/javascript; charset=utf-8"},
                                                              {".mjs", "text/javascript; charset=utf-8"},
                                                              {".css", "text/css; charset=utf-8"},
                                                              {".json", "application/json"},
                                                              {".wasm", "application/wasm"},
                                                              {".svg", "image/svg+xml"},
                                                              {".png", "image/png"},
                                                              {".jpg", "image/jpeg"},
                                                              {".gif", "image/gif"},
                                                              {".ico", "image/x-icon"},
                                                              {".xml", "application/xml"},
                                                              {".txt", "text/plain; charset=utf-8"},
                                                              {".map", "application/json"},
                                                              {".glb", "model/gltf-binary"},
                                                              {".ktx2", "image/ktx2"},
                                                              {".woff2", "font/woff2"}};
  for (const auto& [suffix, type] : types) {
    if (path.extension() == suffix) return type;
  }
  return "application/octet-stream";
}

Response plain_page(const std::vector<Row>& datasets) {
  std::string html =
      "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Cordillera</title>"
      "<style>body{font:16px/1.5 sans-serif;max-width:50em;margin:3em auto;padding:0 1em}code{background:#eee}</style>"
      "<h1>Cordillera</h1><p>The service works, but its viewer is not installed: it is taken from npm when the project is "
      "built. "
      "Install Node.js with npm and build again, or name a folder that holds it with <code>--web</code>.</p>"
      "<p><a href=\"v1\">API</a></p><h2>Datasets</h2>";
  if (datasets.empty()) {
    html += "<p>None yet. Send one: <code>curl --data-binary @dem.tif 'http://HOST/v1/datasets?name=dem.tif'</code></p>";
  }
  html += "<ul>";
  for (const Row& row : datasets) {
    const Dataset& dataset = *row;
    const std::string base = "v1/datasets/" + dataset.id;
    html += "<li><a href=\"" + base + "\">" + pipeline::html_text(dataset.name) + "</a> (" + to_string(dataset.state) + ")";
    if (dataset.state == State::ready) {
      html +=
          ": <a href=\"" + base + "/tileset.json\">tileset.json</a>, <a href=\"" + base + "/manifest.json\">manifest.json</a>";
    }
    html += "</li>";
  }
  Response response;
  response.set("Content-Type", "text/html; charset=utf-8");
  response.set("Cache-Control", "no-store");
  response.body = html + "</ul></html>\n";
  return response;
}

/// The file's path with every link resolved, if it lies in the folder.
std::optional<fs::path> inside(const std::string& folder, const std::string& path) {
  std::error_code error;
  const fs::path root = fs::canonical(folder, error);
  if (error || path.find('\0') != std::string::npos) return std::nullopt;
  const fs::path file = fs::canonical(root / fs::path(path).relative_path(), error);
  if (error || !fs::is_regular_file(file, error)) return std::nullopt;
  return proto::lies_in(file, root) ? std::optional(file) : std::nullopt;
}

/// A file of the folder, as it is or as the build compressed it; nullopt: it cannot be read.
std::optional<Response> file_response(WebFiles& files, const fs::path& file, bool packed, const std::string& type = "",
                                      const char* cached = "no-cache") {
  const auto found = files.find(packed ? fs::path(file.string() + ".br") : file);
  if (!found) return std::nullopt;
  Response response;
  response.shared = {found, &found->bytes};
  if (packed) response.set("Content-Encoding", "br");
  response.set("Content-Type", type.empty() ? content_type(file) : type);
  response.set("Cache-Control", cached);
  response.set("ETag", quoted(found->etag));
  return response;
}

Response unreadable() { return problem_response({"internal", "the file cannot be read", "trying again later", ""}); }

}  // namespace

std::string default_web_folder(const std::string& program) {
  const fs::path prefix = fs::path(program).parent_path().parent_path() / "share";
  std::error_code error;
  return (fs::exists(prefix / "web", error) ? prefix / "web" : prefix / "cordillera" / "web").string();
}

Response page(WebFiles& files, const std::string& folder, const Request& request,
              const std::function<std::vector<Row>()>& datasets) {
  const std::string& path = request.path;
  const bool root = path == "/" || path == "/index.html";
  const auto file = inside(folder, root ? "/index.html" : path);
  if (!file) {
    if (root) return plain_page(datasets());
    return problem_response(
        {"not-found", "there is nothing at " + path.substr(0, 200), "/, /api, /v1 and what they link to", ""});
  }
  std::error_code error;
  const bool packed = fs::is_regular_file(file->string() + ".br", error) && preferred_coding(request, {"br", "gzip"}) == "br";
  return file_response(files, *file, packed).value_or(unreadable());
}

std::optional<Response> file_of_folder(WebFiles& files, const std::string& folder, const std::string& path,
                                       const std::string& type, const char* cached) {
  const auto file = inside(folder, path);
  return file ? file_response(files, *file, false, type, cached) : std::nullopt;
}

Response demo_page(WebFiles& files, const std::string& folder, const std::string& path) {
  const auto file = inside(folder, path);
  if (!file)
    return problem_response({"not-found", "there is no page " + path.substr(0, 100),
                             "demo/cesium.html and what it links to, where the viewer is installed", ""});
  auto found = file_response(files, *file, false);
  if (!found) return unreadable();
  found->set("Content-Security-Policy", access::kLibraryPage);
  return std::move(*found);
}

}  // namespace cordillera::server
