// Parameters in the API's description: which there are, of which types, and in which ranges.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "openapi_document.h"
#include "server/options/mesh_options.h"

namespace cordillera::server {
namespace {

TEST(OpenApi, OptionsOfAPostAreParameters) {
  Words said, wanted;
  const Json document = description();
  for (const Json& parameter : document["paths"]["/v1/datasets"]["post"]["parameters"]) {
    if (parameter["in"] == "query") said.insert(parameter["name"]);
  }
  for (const OptionSpec& option : post_options()) {
    if (option.open_to == OpenTo::requests) wanted.insert(spelt(option.name, Spelling::query));
  }
  for (const char* of_the_body : {"upload", "source", "updates"}) wanted.insert(of_the_body);
  EXPECT_EQ(said, wanted);
  Words of_index;
  TestService test;
  const Json index = body_of(test.get("/v1"));
  for (const auto& [name, option] : index["options"].items()) of_index.insert(name);
  EXPECT_EQ(of_index, wanted) << "of GET /v1";
  EXPECT_EQ(said.count("water_mask"), 0u) << "a request that names a file of the operator's machine is refused";
  Words of_meshes;
  for (const Json& parameter : document["paths"]["/v1/datasets/{id}/mesh.{mesh_format}"]["get"]["parameters"])
    if (parameter.value("in", "") == "query") of_meshes.insert(parameter["name"]);
  EXPECT_EQ(of_meshes.size(), mesh_options().size());
}

/// What is refused without a header says that it is required.
TEST(OpenApi, HeadersOfAnUploadAreRequiredWhereNothingGoesWithoutThem) {
  const Json paths = description()["paths"];
  const auto header = [&paths](const char* path, const char* method, const char* name) {
    for (const Json& parameter : paths[path][method]["parameters"]) {
      if (parameter["name"] == name && parameter["in"] == "header")
        return parameter.value("required", false) ? "required" : "may be";
    }
    return "none";
  };
  const char* one = "/v1/uploads/{id}";
  EXPECT_STREQ(header("/v1/uploads", "post", "Upload-Length"), "required");
  EXPECT_STREQ(header("/v1/uploads", "post", "Upload-Metadata"), "may be");
  EXPECT_STREQ(header("/v1/uploads", "post", "Tus-Resumable"), "may be");
  EXPECT_STREQ(header(one, "patch", "Upload-Offset"), "required");
  for (const char* method : {"get", "patch", "delete"}) EXPECT_STREQ(header(one, method, "Tus-Resumable"), "may be") << method;
}

/// Of a parameter; null: there is none.
Json schema_of(const Json& paths, const char* path, const char* method, const std::string& name) {
  for (const Json& parameter : paths[path][method]["parameters"]) {
    if (parameter.value("name", "") == name) return parameter["schema"];
  }
  return nullptr;
}

TEST(OpenApi, OptionsHaveTheTypesThatTheirRowsTake) {
  const Json paths = description()["paths"];
  const auto posted = [&](const std::string& name) { return schema_of(paths, "/v1/datasets", "post", name); };
  const Json text = {{"type", "string"}}, number = {{"type", "number"}};
  EXPECT_EQ(posted("error"), number);
  EXPECT_EQ(posted("z_scale"), number);
  EXPECT_EQ(posted("threads"), (Json{{"type", "integer"}, {"minimum", 0}, {"maximum", 1024}}));
  EXPECT_EQ(posted("memory"), (Json{{"type", "integer"}}));
  EXPECT_EQ(posted("dry_run"), (Json{{"type", "boolean"}}));
  EXPECT_EQ(posted("provisional"), (Json{{"type", "boolean"}}));
  EXPECT_EQ(posted("bbox"), (Json{{"type", "array"}, {"items", number}}));
  EXPECT_EQ(posted("keep"), posted("bbox"));
  EXPECT_EQ(posted("build"), (Json{{"type", "string"}, {"enum", {"full", "lazy"}}}));
  EXPECT_EQ(posted("strategy"), (Json{{"type", "string"}, {"enum", {"auto", "exact", "cleap", "sequential"}}}));
  for (const char* name : {"band", "crs", "nodata", "voids", "device", "title", "imagery", "vertical_datum"})
    EXPECT_EQ(posted(name), text) << name;
  const Json states = {{"type", "string"}, {"enum", {"queued", "running", "ready", "failed"}}};
  EXPECT_EQ(schema_of(paths, "/v1/datasets", "get", "state"), (Json{{"type", "array"}, {"items", states}}));
  EXPECT_EQ(schema_of(paths, "/v1/datasets", "get", "limit"), (Json{{"type", "integer"}, {"minimum", 1}, {"maximum", 1000}}));
  const Json fields = description()["components"]["schemas"]["posting_fields"]["properties"];
  EXPECT_EQ(fields["bbox"]["type"], "string") << "a form has no lists";
}

TEST(OpenApi, WholeNumbersHaveTheRangeThatIsTaken) {
  const Json paths = description()["paths"];
  const std::string one = "/v1/datasets/{id}/";
  const auto range = [&](const std::string& path, const char* method, const char* name) {
    const Json schema = schema_of(paths, path.c_str(), method, name);
    const std::string most = schema.contains("maximum") ? schema["maximum"].dump() : "";
    return schema["minimum"].dump() + " to " + most + (schema.contains("format") ? " " + std::string(schema["format"]) : "");
  };
  for (const char* method : {"get", "post"}) {
    EXPECT_EQ(range(one + "elevation", method, "samples"), "2 to 5000");
    EXPECT_EQ(range(one + "elevation", method, "level"), "0 to 21");
  }
  EXPECT_EQ(range(one + "mesh.{mesh_format}", "get", "level"), "0 to 21");
  EXPECT_EQ(range(one + "rollback", "post", "to"), "1 to 4294967295 int64");
  EXPECT_EQ(range("/v1/uploads", "post", "Upload-Length"), "1 to  int64");
  EXPECT_EQ(range("/v1/uploads/{id}", "patch", "Upload-Offset"), "0 to  int64");
  for (const char* list : {"/v1/datasets", "/stac/collections/datasets/items"})
    EXPECT_EQ(range(list, "get", "after"), "0 to 9007199254740991 int64");
}

/// The query of an address below it says what is built there, beside what the resource takes.
TEST(OpenApi, BelowLiveStandTheOptionsOfTheBuild) {
  const Json paths = description()["paths"];
  const auto names_at = [&paths](const std::string& path) {
    Words names;
    for (const Json& parameter : paths[path]["get"]["parameters"]) {
      if (parameter.value("in", "") == "query") { EXPECT_TRUE(names.insert(parameter["name"]).second) << path << parameter; }
    }
    return names;
  };
  const Words of_live = names_at("/v1/live");
  EXPECT_TRUE(of_live.contains("error") && of_live.contains("url"));
  for (const auto& [path, item] : paths.items()) {
    if (path.starts_with("/v1/live")) { EXPECT_THAT(names_at(path), testing::IsSupersetOf(of_live)) << path; }
  }
  const char *mesh = "/v1/live/mesh.{mesh_format}", *elevation = "/v1/live/elevation";
  EXPECT_TRUE(names_at(mesh).contains("frame"));
  EXPECT_EQ(schema_of(paths, mesh, "get", "bbox"), schema_of(paths, "/v1/live", "get", "bbox")) << "what is built, not the mesh";
  EXPECT_EQ(schema_of(paths, elevation, "get", "samples"), schema_of(paths, "/v1/datasets/{id}/elevation", "get", "samples"));
}
}  // namespace
}  // namespace cordillera::server
