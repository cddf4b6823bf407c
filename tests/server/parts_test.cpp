// Uploads in parts count where whole rasters do: of one client, and of all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "fixture.h"
#include "server/uploads/part_files.h"

namespace cordillera::server {
namespace {

Request request_of(const std::string& method, const std::string& path, const std::string& client) {
  Request request;
  request.method = method;
  request.path = path;
  request.client = client;
  return request;
}

Response begin(TestService& test, const std::string& client) {
  Request request = request_of("POST", "/v1/uploads", client);
  request.headers = {{"upload-length", "4"}};
  return test.api().handle(request);
}

std::string place_of(const Response& begun) { return "/v1/" + begun.header("Location"); }

Request part_of(const std::string& place, const std::string& client) {
  Request request = request_of("PATCH", place, client);
  request.headers = {{"content-type", "application/offset+octet-stream"}, {"upload-offset", "0"}, {"content-length", "4"}};
  request.read_body = [](const Request::Sink& sink) { return sink("GOOD"); };
  return request;
}

/// Does something while a part is on its way.
template <class Meanwhile>
Response slow_part(TestService& test, const std::string& place, const std::string& client, const Meanwhile& meanwhile) {
  std::promise<void> begun, go;
  Request request = part_of(place, client);
  request.read_body = [&](const Request::Sink& sink) {
    begun.set_value();
    go.get_future().wait();
    return sink("GOOD");
  };
  auto answer = std::async(std::launch::async, [&test, request] { return test.api().handle(request); });
  begun.get_future().wait();
  meanwhile();
  go.set_value();
  return answer.get();
}

TEST(Parts, OfOneClientAreLimited) {
  Settings settings;
  settings.serve.limits.client_uploads = 1;
  TestService test(settings);
  const std::string one = place_of(begin(test, "192.0.2.1")), two = place_of(begin(test, "192.0.2.1")),
                    third = place_of(begin(test, "192.0.2.2"));
  const Response first = slow_part(test, one, "192.0.2.1", [&] {
    const Response second = test.api().handle(part_of(two, "192.0.2.1"));
    EXPECT_EQ(second.status, 429);
    EXPECT_EQ(slug_of(second), "too-many-uploads");
    EXPECT_EQ(test.api().handle(part_of(third, "192.0.2.2")).status, 204);           // another one's are his own
    EXPECT_EQ(test.api().handle(request_of("HEAD", two, "192.0.2.1")).status, 200);  // asking is free
  });
  EXPECT_EQ(first.status, 204);
  EXPECT_EQ(test.api().handle(part_of(two, "192.0.2.1")).status, 204);
}

TEST(Parts, OfAllAreLimitedButTakeNoPlaceInTheQueue) {
  Settings settings;
  settings.serve.limits.uploads = 2;
  settings.serve.limits.queue = 1;
  TestService test(settings);
  const std::string one = place_of(begin(test, "192.0.2.1")), two = place_of(begin(test, "192.0.2.2")),
                    third = place_of(begin(test, "192.0.2.3"));
  slow_part(test, one, "192.0.2.1", [&] {
    EXPECT_EQ(body_of(test.get("/v1/limits"))["in_use"]["max_uploads"], 1);
    EXPECT_THAT(test.post("GOOD").status, testing::AnyOf(201, 202)) << "its build may be over by then";
    slow_part(test, two, "192.0.2.2",
              [&] { EXPECT_EQ(slug_of(test.api().handle(part_of(third, "192.0.2.3"))), "service-busy"); });
  });
  EXPECT_EQ(body_of(test.get("/v1/limits"))["in_use"]["max_uploads"], 0);
}

/// Who sends is told that there is nothing to go on with; "no room" would have him try again.
TEST(Parts, OneThatIsDeletedWhileAPartArrivesIsUnknown) {
  TestService test;
  const std::string one = place_of(begin(test, "192.0.2.1"));
  const Response answer = slow_part(test, one, "192.0.2.1", [&] { EXPECT_EQ(test.send("DELETE", one).status, 204); });
  EXPECT_EQ(answer.status, 404);
  EXPECT_EQ(slug_of(answer), "upload-unknown");
}

/// 409 as long as another request writes, and when that is over; no time changes another offset.
TEST(Parts, WhoWritesBesideAnotherIsToldWhenToAskAgain) {
  TestService test;
  const std::string one = place_of(begin(test, "192.0.2.1"));
  slow_part(test, one, "192.0.2.1", [&] {
    const Response beside = test.api().handle(part_of(one, "192.0.2.1"));
    EXPECT_EQ(slug_of(beside), "upload-conflict");
    EXPECT_EQ(beside.header("Retry-After"), "5");
  });
  const Response behind = test.api().handle(part_of(one, "192.0.2.1"));
  EXPECT_EQ(slug_of(behind), "upload-conflict");
  EXPECT_EQ(behind.header("Retry-After"), "");
}

/// The offset counts bytes of the raster: of a compressed part nobody could tell where to go on.
TEST(Parts, ACompressedOneIsRefused) {
  TestService test;
  const std::string one = place_of(begin(test, "192.0.2.1"));
  Request part = part_of(one, "192.0.2.1");
  for (const char* coding : {"gzip", "GZip", "br", "deflate", "identity, gzip"}) {
    part.headers["content-encoding"] = coding;
    const Response answer = test.api().handle(part);
    EXPECT_EQ(answer.status, 415) << coding;
    EXPECT_EQ(slug_of(answer), "coding-unknown") << coding;
    EXPECT_EQ(answer.header("Accept-Encoding"), "identity");
  }
  EXPECT_EQ(test.get(one).header("Upload-Offset"), "0");
  part.headers["content-encoding"] = "Identity";
  EXPECT_EQ(test.api().handle(part).status, 204);
}

TEST(Parts, OneThatBreaksOffIsToldAndKeptAsFarAsItCame) {
  TestService test;
  const std::string one = place_of(begin(test, "192.0.2.1"));
  Request part = part_of(one, "192.0.2.1");
  part.read_body = [](const Request::Sink& sink) { return sink("GO") && false; };
  const Response answer = test.api().handle(part);
  EXPECT_EQ(answer.status, 400);
  EXPECT_EQ(slug_of(answer), "body-incomplete");
  EXPECT_EQ(test.get(one).header("Upload-Offset"), "2");
  part.headers["upload-offset"] = "2";
  part.read_body = [](const Request::Sink&) { return false; };
  EXPECT_EQ(test.api().handle(part).status, 400) << "not a byte of it";
  part.read_body = [](const Request::Sink& sink) { return sink("OD"); };
  EXPECT_EQ(test.api().handle(part).status, 204);
}

TEST(Parts, AnUploadThatWentIntoADatasetIsNoOtherOne) {
  TestService test;
  const std::string one = place_of(begin(test, "192.0.2.1")), upload = one.substr(one.rfind('/') + 1);
  ASSERT_EQ(test.api().handle(part_of(one, "192.0.2.1")).status, 204);
  const auto post = [&](const std::string& name, const std::map<std::string, std::string>& headers = {}) {
    return test.post("", {{"name", name}, {"upload", upload}}, headers);
  };
  const std::string id = posted_id(post("a.tif"));
  EXPECT_EQ(posted_id(post("a.tif")), id) << "a client that was cut off asks again";
  const Json other = body_of(post("b.tif"));
  EXPECT_EQ(other["type"], "urn:cordillera:problem:idempotency-key-reused");
  EXPECT_EQ(other["parameter"], "upload");
  EXPECT_EQ(other["detail"], "the upload '" + upload + "' went into dataset " + id + ", with other options");
  EXPECT_EQ(body_of(post("b.tif", {{"idempotency-key", "own"}}))["type"], "urn:cordillera:problem:upload-unknown");
  const auto held = test.service().key_token("", "upload " + upload);
  EXPECT_EQ(body_of(post("a.tif"))["parameter"], "upload") << "a request with it is under way";
}

TEST(Parts, AnImpossibleLengthIsToldAsSuch) {
  TestService test;
  const auto begun = [&](const std::string& length) {
    Request request = request_of("POST", "/v1/uploads", "192.0.2.1");
    request.headers = {{"upload-length", length}};
    return slug_of(test.api().handle(request));
  };
  for (const char* length : {"-5", "0", "x", ""}) EXPECT_EQ(begun(length), "upload-invalid") << length;
  EXPECT_EQ(begun("999999999999999"), "body-too-large") << "no room that is made would help";
}

TEST(Parts, ANameIsTextInBase64) {
  TestService test;
  const auto begun = [&](const std::string& metadata) {
    Request request = request_of("POST", "/v1/uploads", "192.0.2.1");
    request.headers = {{"upload-length", "4"}, {"upload-metadata", metadata}};
    return test.api().handle(request);
  };
  const auto named = begun("other eA==, filename ZGVtLnRpZg==");  // dem.tif
  ASSERT_EQ(named.status, 201) << named.body;
  EXPECT_EQ(body_of(test.get(place_of(named)))["name"], "dem.tif");
  for (const char* bad :
       {"filename ZGV.", "filename /w==", "name YQpi", "filename AA=="}) {  // no base64, no UTF-8, a line end, a NUL
    EXPECT_EQ(slug_of(begun(bad)), "upload-invalid") << bad;
  }
}

TEST(Parts, UnfinishedOnesOfOneClientLeaveRoomForOthers) {
  TestService test;
  const auto folder = test.service().layout().uploads();
  const std::string first = begin(test, "192.0.2.1").header("Location").substr(8);
  for (std::size_t k = 1; k < uploads::kMostOfOneSender; ++k) {
    std::filesystem::copy(folder / first, folder / ("copy" + std::to_string(k)), std::filesystem::copy_options::recursive);
  }
  const Response refused = begin(test, "192.0.2.1");
  EXPECT_EQ(refused.status, 429);
  EXPECT_EQ(slug_of(refused), "too-many-uploads");
  EXPECT_EQ(begin(test, "192.0.2.2").status, 201);
  EXPECT_EQ(test.api().handle(request_of("DELETE", "/v1/uploads/" + first, "192.0.2.1")).status, 204);
  EXPECT_EQ(begin(test, "192.0.2.1").status, 201);
}

}  // namespace
}  // namespace cordillera::server
