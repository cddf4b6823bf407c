#pragma once
// A dataset whose provisional tiles stand, and whose job waits to be told to go on.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "fixture.h"

namespace cordillera::server {

inline std::string id_of(const Response& response) { return body_of(response).value("id", ""); }

/// Not server::Live, which is an answer of the API.
namespace live_fixture {

class Live : public testing::Test {
 protected:
  /// Posted, and its provisional tiles stand.
  std::string posted(const Given& query = {}) {
    const std::string id = id_of(test_.post("LIVE", query));
    EXPECT_TRUE(eventually([&] { return body_of(test_.get(at(id)))["provisional"] == true; }));
    return id;
  }
  static std::string at(const std::string& id, const std::string& path = "") { return "/v1/datasets/" + id + path; }
  void tell_job(const std::string& id, const char* what) { std::ofstream(test_.data() / "datasets" / id / what) << "now"; }
  bool reaches(const std::string& id, const std::string& state) {
    return eventually([&] { return body_of(test_.get(at(id)))["state"] == state; });
  }
  TestService test_;
};

}  // namespace live_fixture

}  // namespace cordillera::server
