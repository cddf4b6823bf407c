#include "server/api/documents/openapi.h"

#include "server/http/digest.h"

namespace cordillera::server {
namespace {

constexpr const char* kAbout =
    "Post an elevation model, fetch level-of-detail terrain tiles. One dataset is served in several formats at once; what each "
    "client reads "
    "is a family of addresses below the dataset's own. Every resource that has a GET answers a HEAD, and documents and tiles "
    "carry an ETag. "
    "Errors are application/problem+json (RFC 9457).";

Json tag(const char* name, const char* about) { return {{"name", name}, {"description", about}}; }

std::string made_document(Tokens tokens) {
  Json json;
  json["openapi"] = "3.1.0";
  json["info"] = {{"title", "Cordillera"},
                  {"version", CORDILLERA_VERSION},
                  {"description", kAbout},
                  {"license", {{"name", "Apache-2.0"}, {"identifier", "Apache-2.0"}}}};
  json["servers"] = Json::array({{{"url", "."}, {"description", "where this document is"}}});
  // Without a token; where the service asks for one, with it.
  json["security"] = Json::array({Json::object(), {{"bearer", Json::array()}}});
  json["tags"] = Json::array({tag("datasets", "Posting, watching and removing elevation models"),
                              tag("uploads", "Rasters that arrive in parts and survive a broken connection"),
                              tag("tiles", "What map and globe clients fetch"),
                              tag("live", "The same of a raster's address, without a post"),
                              tag("versions", "The same, at addresses whose content never changes"),
                              tag("meshes", "Parts of a dataset for other programs"), tag("heights", "Elevation queries"),
                              tag("stac", "Datasets as a catalog"), tag("service", "The service itself")});
  json["paths"] = openapi::all_paths(tokens);
  json["components"] = openapi::components();
  return dump(json);
}

}  // namespace

Response api_description(Tokens tokens) {
  struct Document {
    explicit Document(Tokens of) : text(made_document(of)), tag(quoted(digest(text).substr(0, 32))) {}
    std::string text, tag;
  };
  static const Document kOpen(Tokens::none), kGuarded(Tokens::asked_for);
  const Document& document = tokens == Tokens::none ? kOpen : kGuarded;
  Response response;
  response.set("Content-Type", kOpenApiType);
  response.body = document.text;
  response.set("Cache-Control", "public, no-cache");
  response.set("ETag", document.tag);
  return response;
}

}  // namespace cordillera::server
