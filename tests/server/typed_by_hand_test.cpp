// HTTP as hands type it: PUT on the collection, slashes too many, JSON, forms; and what browsers ask for by themselves.
#include "server/api/requests/typed_by_hand.h"

#include <gmock/gmock.h>

#include "fixture.h"
#include "form_text.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

TEST(TypedByHand, AFormBecomesADataset) {
  TestService test;
  const Response posted =
      test.post(form_part("name=error", "5") + form_file("GOOD") + form_part("name=title", "a & b") + kFormEnd, {},
                {{"content-type", kForm}, {"prefer", "wait=100"}});
  ASSERT_EQ(posted.status, 201) << posted.body;
  EXPECT_EQ(body_of(posted)["name"], "dem.tif");
  const auto dataset = test.service().registry().find(body_of(posted)["id"]);
  EXPECT_EQ(dataset->options.error(), 5);
  EXPECT_EQ(dataset->options.title(), "a & b");
  EXPECT_EQ(dataset->raster, "source.tif");
  EXPECT_EQ(body_of(test.post(form_part("name=name", "other.hgt") + form_file("GOOD") + kFormEnd, {},
                              {{"content-type", kForm}}))["name"],
            "other.hgt");
  const std::string blank = form_part("name=error", "") + form_part("name=crs", "") + form_part("name=private", "");
  const Response made = test.post(blank + form_file("GOOD") + kFormEnd, {}, {{"content-type", kForm}, {"prefer", "wait=100"}});
  ASSERT_EQ(made.status, 201) << "a page sends fields that were left blank: " << made.body;
  EXPECT_EQ(body_of(made)["private"], false);
}

TEST(TypedByHand, SeveralFilesBecomeOneDatasetOfSeveralRasters) {
  TestService test;
  const std::string first =
      body_of(test.post("SLOW"))["id"];  // the other waits behind it: a played job knows of one raster alone
  const std::string form = form_part("name=crs", "EPSG:4326") + form_file("SLOW one", "west.tif") + form_file("two", "east.hgt") +
                           form_file("three", "") + kFormEnd;
  const Response posted = test.post(form, {}, {{"content-type", kForm}, {"idempotency-key", "k"}});
  ASSERT_EQ(posted.status, 202) << posted.body;
  const std::string id = body_of(posted)["id"];
  EXPECT_EQ(body_of(posted)["name"], "west.tif");
  const auto sources = test.service().ledger().expected(id);
  ASSERT_EQ(sources.size(), 3u);
  const char* names[] = {"west.tif", "east.hgt", "raster"};
  const char* bytes[] = {"SLOW one", "two", "three"};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(sources[k].spec().name(), names[k]) << "the first wins";
    EXPECT_EQ(file_text(test.service().layout().dataset(id) / sources[k].spec().path()), bytes[k]);
    EXPECT_EQ(sources[k].bytes(), std::string(bytes[k]).size());
    EXPECT_EQ(sources[k].spec().options().crs(), "EPSG:4326");
  }
  EXPECT_NE(sources[0].id(), sources[1].id());
  const Response again = test.post(form, {}, {{"content-type", kForm}, {"idempotency-key", "k"}});
  EXPECT_EQ(body_of(again)["id"], id) << again.body;
  const std::string other = form_part("name=crs", "EPSG:4326") + form_file("SLOW one", "west.tif") +
                            form_file("TWO", "east.hgt") + form_file("three", "") + kFormEnd;
  EXPECT_EQ(slug_of(test.post(other, {}, {{"content-type", kForm}, {"idempotency-key", "k"}})), "idempotency-key-reused");
  for (const std::string& one : {id, first}) EXPECT_EQ(test.send("DELETE", "/v1/datasets/" + one).status, 204);
}

TEST(TypedByHand, OptionsMayBeSpeltAsOnTheCommandLine) {
  TestService test;
  const Response query = test.post("SLOW", {{"source-nodata", "-9999"}, {"fill-limit", "40"}});
  const Response form =
      test.post(form_part("name=vertical-datum", "ellipsoid") + form_file("GOOD") + kFormEnd, {}, {{"content-type", kForm}});
  ASSERT_EQ(query.status, 202) << query.body;
  ASSERT_EQ(form.status, 202) << form.body;
  const auto options = [&](const Response& posted) { return test.service().registry().find(body_of(posted)["id"])->options; };
  EXPECT_EQ(options(query).nodata(), "-9999");
  EXPECT_EQ(options(query).fill_limit(), 40u);
  EXPECT_EQ(options(form).vertical_datum(), "ellipsoid");
  EXPECT_EQ(slug_of(test.post("SLOW", {{"fill-limit", "40"}, {"fill_limit", "40"}})), "option-repeated");
  for (const Response& posted : {form, query})
    EXPECT_EQ(test.send("DELETE", "/v1/datasets/" + std::string(body_of(posted)["id"])).status, 204);
}

/// A header, a CRS, a world file: no rasters of their own, wherever they stand in the form.
TEST(TypedByHand, FilesThatGoWithARasterAreNoRasters) {
  TestService test;
  const std::string first = body_of(test.post("SLOW", {}, {}))["id"];  // the others wait behind it, as they came
  const auto sources = [&](const std::string& form) {
    const Response posted = test.post(form + kFormEnd, {}, {{"content-type", kForm}});
    EXPECT_EQ(posted.status, 202) << posted.body;
    return std::pair(body_of(posted), test.service().layout().dataset(body_of(posted)["id"]));
  };
  const auto [one, folder] = sources(form_file("header", "dem.hdr") + form_file("heights", "DEM.bil") +
                                     form_file("crs", "dem.prj") + form_file("notes", "dem.bil.aux.xml"));
  EXPECT_EQ(one["name"], "DEM.bil");
  EXPECT_FALSE(one.contains("updates")) << "several rasters";
  const std::string archive = file_text(folder / "source.bil");
  EXPECT_THAT(archive, ::testing::StartsWith("PK\x03\x04"));
  for (const char* part : {"DEM.bil", "heights", "dem.hdr", "header", "dem.prj", "dem.bil.aux.xml"})
    EXPECT_THAT(archive, HasSubstr(part));
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    EXPECT_THAT(entry.path().filename().string(), ::testing::Not(::testing::StartsWith("more")));
  const auto [two, place] = sources(form_file("one", "west.tif") + form_file("two", "east.tif") + form_file("world", "east.tfw") +
                                    form_file("stray", "north.tfw"));
  const auto rasters = test.service().ledger().expected(two["id"]);
  ASSERT_EQ(rasters.size(), 3u);
  EXPECT_EQ(file_text(place / rasters[0].spec().path()), "one");
  EXPECT_THAT(file_text(place / rasters[1].spec().path()),
              ::testing::AllOf(::testing::StartsWith("PK"), HasSubstr("east.tfw"), HasSubstr("world")));
  EXPECT_EQ(rasters[1].spec().name(), "east.tif");
  EXPECT_EQ(file_text(place / rasters[2].spec().path()), "stray");
  for (const std::string& id : {first, one["id"].get<std::string>(), two["id"].get<std::string>()})
    EXPECT_EQ(test.send("DELETE", "/v1/datasets/" + id).status, 204);
}

TEST(TypedByHand, ABadFormLeavesNothing) {
  TestService test;
  const auto slug = [&](const std::string& form, const std::map<std::string, std::string>& more = {}) {
    std::map<std::string, std::string> headers = {{"content-type", kForm}};
    headers.insert(more.begin(), more.end());
    return slug_of(test.post(form, {}, headers));
  };
  EXPECT_EQ(slug(form_part("name=error", "5") + kFormEnd), "form-invalid");
  EXPECT_EQ(slug(form_part("name=file", "dem.tif") + kFormEnd), "form-invalid");
  EXPECT_EQ(slug(form_file("GOOD") + form_file("", "b.tif") + kFormEnd), "body-empty");
  EXPECT_EQ(slug(form_file("GOOD") + form_file("GOOD") + form_part("name=dry_run", "1") + kFormEnd), "options-conflict");
  EXPECT_EQ(slug(form_file("GOOD") + form_file("GOOD") + form_part("name=updates", "0") + kFormEnd), "options-conflict");
  EXPECT_EQ(slug(form_file("GOOD") + form_file("GOOD")), "body-incomplete");
  EXPECT_EQ(slug(form_file("GOOD")), "body-incomplete");
  EXPECT_EQ(slug(form_file("") + kFormEnd), "body-empty");
  EXPECT_EQ(body_of(test.post(form_file("") + kFormEnd, {}, {{"content-type", kForm}}))["detail"],
            "the file of the form is empty");
  EXPECT_EQ(slug(form_file("GOOD") + form_part("name=eror", "5") + kFormEnd), "option-unknown");
  EXPECT_EQ(slug(form_part("name=error", "5") + form_part("name=error", "6") + form_file("GOOD") + kFormEnd), "option-repeated");
  EXPECT_EQ(slug(form_file("GOOD") + form_part("name=upload", "abc") + kFormEnd), "options-conflict");
  EXPECT_EQ(test.leftovers(), 0u);
}

Response put(TestService& test, const std::string& path, const std::string& body, const Given& query = {}) {
  Request request;
  request.method = "PUT";
  request.path = path;
  request.query = query;
  request.headers = {{"content-length", std::to_string(body.size())}};
  request.read_body = [body](const Request::Sink& sink) { return sink(body); };
  return test.api().handle(request);
}

TEST(TypedByHand, APutOnTheCollectionIsAPost) {
  TestService test;
  const Response plain = put(test, "/v1/datasets", "GOOD", {{"name", "a.tif"}});
  EXPECT_EQ(plain.status, 202) << plain.body;
  EXPECT_THAT(plain.header("Location"), testing::StartsWith("/v1/datasets/a-"));
  const Response named = put(test, "/v1/datasets/H\xc3\xb6he.tif", "GOOD");  // what curl makes of …/v1/datasets/
  EXPECT_EQ(body_of(named)["name"], "H\xc3\xb6he.tif") << named.body;
  EXPECT_THAT(named.header("Location"), testing::StartsWith("/v1/datasets/h-he-"));
  EXPECT_THAT(std::string(body_of(named)["links"]["self"]), testing::StartsWith("/v1/datasets/h-he-"));
  const Response taken = put(test, "/v1/datasets/" + std::string(body_of(plain)["id"]), "GOOD");
  EXPECT_EQ(taken.status, 405) << "a dataset is not replaced";
  EXPECT_EQ(put(test, "/v1/datasets/dem", "GOOD").status, 405) << "it may be an id";
  EXPECT_THAT(std::string(body_of(taken)["accepted"]), HasSubstr("PUT /v1/datasets?name=NAME"));
  EXPECT_EQ(put(test, "/v1/datasets/a/b.tif", "GOOD").status, 404);
  EXPECT_EQ(put(test, "/v1/datasetsx.tif", "GOOD").status, 404);
  for (const char* path : {"/", "/v1", "/upload", "/datasets"}) {
    const Response told = put(test, path, "GOOD");
    EXPECT_EQ(told.status, 405) << path;
    EXPECT_THAT(std::string(body_of(told)["accepted"]), testing::EndsWith("; rasters go to POST /v1/datasets")) << path;
  }
}

TEST(TypedByHand, ASlashTooManyIsNoMistake) {
  TestService test;
  const std::string id = body_of(test.post("GOOD", {}, {{"prefer", "wait=100"}}))["id"];
  for (const std::string& path :
       {std::string("/v1"), std::string("/v1/datasets"), std::string("/v1/limits"), "/v1/datasets/" + id}) {
    const Response moved = test.get(path + "/");
    EXPECT_EQ(moved.status, 308) << path;
    EXPECT_EQ(moved.header("Location"), "../" + path.substr(path.rfind('/') + 1));
  }
  EXPECT_EQ(test.get("/v1/other/").status, 404);
  for (const char* path :
       {"/docs", "/openapi.json", "/api", "/version", "/healthz", "/readyz", "/metrics", "/stac/collections", "/favicon.ico"}) {
    ASSERT_EQ(test.get(path).status, 200) << path;
    const Response moved = test.get(std::string(path) + "/");
    EXPECT_EQ(moved.status, 308) << path;
    EXPECT_EQ(moved.header("Location"), "../" + std::string(path).substr(std::string(path).rfind('/') + 1)) << path;
  }
  EXPECT_EQ(test.get("/stac/").status, 200);
  EXPECT_NE(test.get("/other/").status, 308);
  EXPECT_EQ(test.send("DELETE", "/v1/datasets/" + id + "/").status, 204);
}

TEST(TypedByHand, OptionsMayBeJson) {
  TestService test;
  const auto posted = [&](const std::string& body) { return test.post(body, {}, {{"content-type", "application/json"}}); };
  // Nothing is fetched here, for no address is allowed: that it is asked for is what counts.
  const Response source = posted(R"({"source": "https://example.org/dem.tif", "error": 5, "keep": null})");
  EXPECT_EQ(slug_of(source), "option-forbidden");
  EXPECT_THAT(source.body, HasSubstr("this service fetches no rasters"));
  EXPECT_THAT(posted(R"({"source": "https://example.org/dem.tif", "bbox": [10, 46.5, 11]})").body,
              HasSubstr("bbox='10,46.5,11': 3 numbers instead of 4"));
  const Response unknown = posted(R"({"eror": true})");
  EXPECT_EQ(slug_of(unknown), "option-unknown");
  EXPECT_EQ(body_of(unknown)["detail"], "unknown member 'eror'; did you mean error?");
  EXPECT_THAT(std::string(body_of(unknown)["accepted"]), testing::StartsWith("source, upload, updates, name"));
  EXPECT_THAT(posted(R"({"sorce": "https://example.org/dem.tif"})").body, HasSubstr("did you mean source?"));
  EXPECT_EQ(slug_of(posted(R"({"error": 5})")), "body-empty");
  for (const char* several : {R"({"source": ["https://a.org/a.tif", "https://a.org/b.tif"]})",
                              R"({"source": "https://a.org/a.tif, https://a.org/b.tif"})", R"({"source": ["a", "b"]})"}) {
    const Response refused = posted(several);
    EXPECT_EQ(slug_of(refused), "option-invalid") << several;
    EXPECT_THAT(refused.body, testing::AllOf(HasSubstr("source names several rasters"), HasSubstr("/sources?source=ADDRESS")))
        << several;
  }
  for (const char* one : {R"({"source": ["https://example.org/dem.tif"]})", R"({"source": "https://example.org/a,b.tif"})"})
    EXPECT_EQ(slug_of(posted(one)), "option-forbidden") << one;
  EXPECT_THAT(posted(R"({"source": null, "error": 5})").body, HasSubstr("source is null"));
  EXPECT_EQ(slug_of(posted(R"({"source": "https://a.org/a.tif", "error": 5, "error": 6})")), "option-repeated");
  EXPECT_THAT(posted(R"({"error": 5,})").body, HasSubstr("no JSON from its byte 13 on"));
  EXPECT_THAT(posted(R"({"error": 5})").body, HasSubstr("or source= with its address"));
  for (const char* bad : {"", "[]", "{", R"({"error": {"a": 1}})", R"({"bbox": [[1]]})"})
    EXPECT_EQ(slug_of(posted(bad)), "json-invalid") << bad;
  EXPECT_EQ(slug_of(posted("{\"title\": \"" + std::string(70000, 'x') + "\"}")), "json-invalid");
}

TEST(TypedByHand, OptionsMayBeWhatCurlSendsWithD) {
  TestService test;
  const auto posted = [&](const std::string& body, const Given& query = {}) {
    return test.post(body, query, {{"content-type", "application/x-www-form-urlencoded"}, {"prefer", "wait=100"}});
  };
  // Nothing is fetched here, for no address is allowed: that it is asked for is what counts.
  for (const char* body : {"source=https://example.org/dem.tif", "source=https%3A%2F%2Fexample.org%2fdem.tif&error=5\n",
                           R"({"source": "https://example.org/dem.tif"})"}) {
    const Response asked = posted(body);
    EXPECT_EQ(slug_of(asked), "option-forbidden") << body;
    EXPECT_THAT(asked.body, HasSubstr("this service fetches no rasters")) << body;
  }
  EXPECT_THAT(posted("title=a+b%20c&bbox=10,46").body, HasSubstr("bbox='10,46': 2 numbers instead of 4"));
  EXPECT_THAT(posted("eror=5").body, HasSubstr("unknown field 'eror'; did you mean error?"));
  EXPECT_EQ(slug_of(posted("error=5")), "body-empty");
  EXPECT_EQ(test.leftovers(), 0u);
}

TEST(TypedByHand, ARasterMayBeCalledAForm) {
  TestService test;
  const auto posted = [&](const std::string& body) {
    return test.post(body, {{"name", "a.tif"}}, {{"content-type", "application/x-www-form-urlencoded"}});
  };
  const std::string bodies[] = {"SLOW", "SLOW a=b", "SLOW\n" + std::string(100000, '\x81'), "SLOW" + std::string(100000, 'x'),
                                "SLOW {\"error\": 5}"};
  for (const std::string& body : bodies) {
    const Response made = posted(body);
    ASSERT_EQ(made.status, 202) << made.body;
    const std::string id = body_of(made)["id"];
    const auto dataset = test.service().registry().find(id);
    EXPECT_EQ(file_text(test.service().layout().dataset(id) / dataset->raster), body)
        << "as curl --data-binary @dem.tif sends it";
    EXPECT_EQ(test.send("DELETE", "/v1/datasets/" + id).status, 204);
  }
  EXPECT_EQ(slug_of(posted("")), "body-empty");
  for (const std::size_t size : {80, 100000}) {
    const Response refused = posted("II*\b" + std::string(size, '\x81'));
    EXPECT_EQ(slug_of(refused), "body-stripped") << size;
    EXPECT_THAT(refused.body, HasSubstr("curl --data-binary @dem.tif"));
  }
  for (const std::string rows : {"10.00 47.59 010.01 47.59 3", "10,47.59,0.5e1", "ncols 60nrows 60xllcorner 10yllcorner 47"}) {
    const Response refused =
        test.post(rows + std::string(100, '4'), {{"name", "a.xyz"}}, {{"content-type", "application/x-www-form-urlencoded"}});
    EXPECT_EQ(slug_of(refused), "body-stripped") << rows;
  }
  EXPECT_EQ(test.leftovers(), 0u);
}

/// Its length is that of the compressed bytes, which may be few.
TEST(TypedByHand, ACompressedRasterMayBeCalledAForm) {
  TestService test;
  const std::string raster = "SLOW" + std::string(100000, 'x');
  const Response made =
      test.post(raster, {{"name", "a.tif"}},
                {{"content-type", "application/x-www-form-urlencoded"}, {"content-encoding", "gzip"}, {"content-length", "200"}});
  ASSERT_EQ(made.status, 202) << made.body;
  const std::string id = body_of(made)["id"];
  const auto dataset = test.service().registry().find(id);
  EXPECT_EQ(file_text(test.service().layout().dataset(id) / dataset->raster), raster);
}

TEST(TypedByHand, AFormMayNameItsRasterAlone) {
  TestService test;
  const auto posted = [&](const std::string& form) { return test.post(form, {}, {{"content-type", kForm}}); };
  const Response source =
      posted(form_part("name=source", "https://example.org/dem.tif") + form_part("name=error", "5") + kFormEnd);
  EXPECT_EQ(slug_of(source), "option-forbidden");
  EXPECT_THAT(source.body, HasSubstr("this service fetches no rasters"));
  EXPECT_THAT(posted(form_part("name=eror", "5") + form_file("GOOD") + kFormEnd).body,
              HasSubstr("unknown field 'eror'; did you mean error?"));
  EXPECT_EQ(test.leftovers(), 0u);
}

TEST(TypedByHand, BrowsersGetTheirPages) {
  TestService test;
  EXPECT_EQ(test.get("/openapi.json").body, test.get("/api").body);
  EXPECT_EQ(body_of(test.get("/version"))["version"], CORDILLERA_VERSION);
  const Response docs = test.get("/docs");
  EXPECT_THAT(docs.header("Content-Type"), HasSubstr("text/html"));
  const Json paths = body_of(test.get("/api"))["paths"];
  for (const auto& [path, item] : paths.items()) EXPECT_THAT(docs.body, HasSubstr(" " + path + "</code>"));
  const std::string icon = test.get("/favicon.ico").body;
  ASSERT_EQ(icon.size(), 22u + 40 + 8 + 128);
  EXPECT_EQ(icon.substr(0, 6), std::string("\0\0\1\0\1\0", 6));
}

}  // namespace
}  // namespace cordillera::server
