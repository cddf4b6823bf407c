// `cordillera check` of a dataset of several rasters: each is read as it was for the build.
#include <gmock/gmock.h>

#include "program_fixture.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

/// Two pieces of a slope beside each other, with 50 m of the geoid between the surfaces that they count from.
class CheckOfMany : public Program {
 protected:
  void SetUp() override {
    for (const char* name : {"west.asc", "east.asc"}) {
      std::ofstream text(folder_.path() / name);
      text << "ncols 32\nnrows 32\nxllcorner " << (name[0] == 'w' ? "10" : "10.2666666666667")
           << "\nyllcorner 46\ncellsize 0.0083333333333333\n";
      for (int row = 0; row < 32; ++row) {
        for (int column = 0; column < 32; ++column) text << 500 + row * 3 + column * 2 << ' ';
        text << '\n';
      }
    }
    std::ofstream(folder_.path() / "list.txt") << "west.asc vertical_datum=ellipsoid\neast.asc\n";
  }
  std::string at(const std::string& name) const { return (folder_.path() / name).string(); }
};

TEST_F(CheckOfMany, EachCountsFromItsOwnDatum) {
  for (const char* out : {"both.sqlite", "both"}) {
    const Ended built = shell(kProgram + " build " + at("list.txt") + " --crs EPSG:4326 --error 5 --device cpu -q -o " + at(out));
    ASSERT_EQ(built.code, 0) << built.output;
    const Json manifest = Json::parse(shell(kProgram + " info --json " + at(out)).output);
    ASSERT_EQ(manifest["source"]["vertical_datum"], "mixed");
    const std::string check = kProgram + " check " + at(out);
    for (const std::string& sources :
         {" --source " + at("list.txt"), " --source " + at("west.asc") + " --source " + at("east.asc")}) {
      const Ended checked = shell(check + sources);
      EXPECT_EQ(checked.code, 0) << out << sources << checked.output;
      EXPECT_THAT(checked.output, HasSubstr("tiles measured"));
    }
    const Ended turned = shell(check + " --source " + at("east.asc") + " --source " + at("east.asc"));
    EXPECT_EQ(turned.code, 1) << "another raster: " << turned.output;
    const Ended listed = shell(check + " --source " + at("west.asc") + " " + at("east.asc"));
    EXPECT_EQ(listed.code, 2);
    EXPECT_THAT(listed.output, HasSubstr("accepted: --source in front of each raster; see cordillera check --help"));
  }
}

}  // namespace
}  // namespace cordillera::server
