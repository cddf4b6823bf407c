// A CRS that nobody named is told by what it does.
#include "raster/place/crs_label.h"

#include <gmock/gmock.h>

namespace cordillera::raster_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string label(const std::string& definition) {
  OGRSpatialReference srs;
  EXPECT_EQ(srs.SetFromUserInput(definition.c_str()), OGRERR_NONE) << definition;
  return raster::crs_label(srs);
}

TEST(CrsLabel, IsTheNameAndCodeWhereThereIsOne) {
  EXPECT_EQ(label("EPSG:32611"), "WGS 84 / UTM zone 11N (EPSG:32611)");
  EXPECT_EQ(label("EPSG:4326"), "WGS 84 (EPSG:4326)");
}

TEST(CrsLabel, IsALineHoweverLongItsName) {
  const std::string name(3000, 'n');
  const std::string geographic = "GEOGCS[\"" + name + "\",DATUM[\"" + name + "\",SPHEROID[\"" + name +
                                 "\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0]," + "UNIT[\"degree\",0.0174532925199433]]";
  EXPECT_LT(label(geographic).size(), 300U);
  EXPECT_THAT(label(geographic), HasSubstr("nnn"));
}

TEST(CrsLabel, IsProjectionBaseAndParametersWhereThereIsNoName) {
  const std::string mercator = label("+proj=tmerc +lat_0=31 +lon_0=-115.5 +k=0.9999 +x_0=2500000 +datum=NAD83 +units=m");
  EXPECT_THAT(mercator, AllOf(HasSubstr("Transverse Mercator on North American Datum 1983"), HasSubstr("+lon_0=-115.5"),
                              HasSubstr("+k=0.9999")));
  EXPECT_THAT(mercator, AllOf(Not(HasSubstr("unknown")), Not(HasSubstr("no_defs"))));
  EXPECT_THAT(label("+proj=stere +lat_0=-90 +lat_ts=-71 +lon_0=80 +ellps=WGS84 +units=m"), HasSubstr("+lat_ts=-71"));
  EXPECT_THAT(label("+proj=longlat +ellps=bessel"), AllOf(HasSubstr("degrees on Bessel 1841"), Not(HasSubstr("unknown"))));
  EXPECT_THAT(label("+proj=longlat +a=6371200 +b=6371200"), AllOf(HasSubstr("an ellipsoid of its own"), HasSubstr("6371200")));
}

TEST(CrsLabel, IsUtf8WhateverTheFileHas) {
  OGRSpatialReference srs;
  srs.SetWellKnownGeogCS("WGS84");
  srs.SetUTM(32);
  srs.SetProjCS("Syst\xe8me local");  // Latin-1, as many files have it
  EXPECT_EQ(raster::crs_label(srs), "Système local");
  srs.SetProjCS("Système local");
  EXPECT_EQ(raster::crs_label(srs), "Système local");
}

TEST(CrsLabel, IsNoLongerThanALine) {
  std::string grids = "+proj=utm +zone=33 +ellps=intl +towgs84=";
  for (int i = 0; i < 7; ++i) grids += std::string(i ? "," : "") + "-87.123456789012";
  EXPECT_LE(label(grids).size(), 300u);
}

}  // namespace
}  // namespace cordillera::raster_test
