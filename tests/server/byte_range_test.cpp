// Which part of an answer a Range means.
#include "server/http/byte_range.h"

#include <gtest/gtest.h>

#include "fixture.h"
#include "server/datasets/whole_share.h"

namespace cordillera::server {
namespace {

Request asking(const std::string& range, const std::string& condition = "") {
  Request request;
  if (!range.empty()) request.headers["range"] = range;
  if (!condition.empty()) request.headers["if-range"] = condition;
  return request;
}

/// "first+size", "whole" or "nothing" of 1000 bytes.
std::string part(const Request& request) {
  const Wanted wanted = wanted_part(request, 1000, "\"tag\"");
  if (wanted.what == Wanted::What::whole) return "whole";
  return wanted.what == Wanted::What::nothing ? "nothing"
                                              : std::to_string(wanted.part.first) + "+" + std::to_string(wanted.part.size);
}

TEST(ByteRange, IsReadAsHttpHasIt) {
  const std::pair<const char*, const char*> rows[] = {{"", "whole"},
                                                      {"bytes=0-0", "0+1"},
                                                      {"bytes=0-99", "0+100"},
                                                      {"bytes=990-2000", "990+10"},
                                                      {"bytes=5-", "5+995"},
                                                      {"bytes=-1", "999+1"},
                                                      {"bytes=-5000", "0+1000"},
                                                      {"bytes=-0", "nothing"},
                                                      {"bytes=1000-", "nothing"},
                                                      {"bytes=1000-1001", "nothing"},
                                                      {"bytes=9-8", "whole"},
                                                      {"bytes=0-1,4-5", "whole"},
                                                      {"tiles=0-1", "whole"},
                                                      {"bytes=-", "whole"},
                                                      {"bytes=a-b", "whole"},
                                                      {"bytes=1", "whole"},
                                                      {"bytes=+1-2", "whole"},
                                                      {"bytes= 1-2", "1+2"},
                                                      {"Bytes=1-2", "1+2"},
                                                      {"bytes=1-2 ,", "1+2"},
                                                      {"bytes=,\t, 1-2", "1+2"},
                                                      {"bytes=1 -2", "whole"},
                                                      {"bytes=,", "whole"},
                                                      {"bytes", "whole"},
                                                      {"bytes=0-99999999999999999999999", "0+1000"},
                                                      {"bytes=99999999999999999999999-", "nothing"}};
  for (const auto& [range, wanted] : rows) EXPECT_EQ(part(asking(range)), wanted) << range;
}

TEST(ByteRange, IsLeftWhereItsConditionFails) {
  EXPECT_EQ(part(asking("bytes=0-9", "\"tag\"")), "0+10");
  for (const char* other : {"\"other\"", "W/\"tag\"", "Mon, 23 Nov 2026 20:00:00 GMT"})
    EXPECT_EQ(part(asking("bytes=0-9", other)), "whole") << other;
  Request head = asking("bytes=0-9");
  head.method = "HEAD";
  EXPECT_EQ(part(head), "whole") << "ranges are of a GET";
}

TEST(ByteRange, CutsAnAnswer) {
  Response whole;
  whole.body = "0123456789";
  whole.set("ETag", "\"tag\"");
  whole.set("Accept-Ranges", "bytes");
  const Response cut = cut_to_range(asking("bytes=2-4"), whole);
  EXPECT_EQ(cut.status, 206);
  EXPECT_EQ(cut.body, "234");
  EXPECT_EQ(cut.header("Content-Range"), "bytes 2-4/10");
  EXPECT_EQ(cut.header("Accept-Ranges"), "bytes");
  const Response none = cut_to_range(asking("bytes=10-"), whole);
  EXPECT_EQ(none.status, 416);
  EXPECT_EQ(none.header("Content-Range"), "bytes */10");
  EXPECT_EQ(none.header("Accept-Ranges"), "bytes");
  EXPECT_EQ(cut_to_range(asking(""), whole).status, 200);
}

TEST(WholeShare, GrowsFromStageToStage) {
  double before = -1;
  for (const char* stage : {"fetch", "provisional", "open", "plan", "build", "merge", "publish"}) {
    for (const double done : {0.0, 5.0, 10.0}) {
      proto::Progress progress;
      progress.set_stage(stage);
      progress.set_total(10);
      progress.set_done(done);
      EXPECT_GE(whole_share(progress), before) << stage << " " << done;
      before = whole_share(progress);
    }
  }
  EXPECT_EQ(before, 1);
}

TEST(WholeShare, NeverFallsUntilTheJobHasEnded) {
  ProgressHub hub;
  proto::Progress late, early;
  late.set_stage("merge");
  late.set_total(1);
  early.set_stage("open");
  hub.publish("a", late);
  const double share = hub.now("a").share;
  hub.publish("a", early);
  EXPECT_EQ(hub.now("a").share, share) << "it is built once more after a crash";
  hub.ended("a");
  EXPECT_EQ(hub.now("a").share, 0);
}

}  // namespace
}  // namespace cordillera::server
