#include "bad_rows.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>

namespace cordillera::raster_test {
namespace {

using namespace std::string_literals;

template <class T>
T get(const std::string& bytes, std::size_t at) {
  T value{};
  if (at + sizeof value <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}
template <class T>
void put(std::string& bytes, std::size_t at, T value) {
  if (at + sizeof value <= bytes.size()) std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// Of a little-endian classic TIFF: where the entries of its first directory stand.
std::vector<std::size_t> entries(const std::string& tiff) {
  const std::size_t directory = get<std::uint32_t>(tiff, 4);
  std::vector<std::size_t> at;
  for (std::size_t k = 0; k < get<std::uint16_t>(tiff, directory); ++k) at.push_back(directory + 2 + 12 * k);
  return at;
}
std::size_t next_directory(const std::string& tiff) {
  const std::size_t directory = get<std::uint32_t>(tiff, 4);
  return directory + 2 + 12 * std::size_t{get<std::uint16_t>(tiff, directory)};
}
/// Sets the value of a tag that holds it itself.
std::string with_tag(std::string tiff, std::uint16_t tag, std::uint32_t value) {
  for (const std::size_t at : entries(tiff)) {
    if (get<std::uint16_t>(tiff, at) != tag) continue;
    const bool is_short = get<std::uint16_t>(tiff, at + 2) == 3;
    if (is_short && value > 0xffff) put<std::uint16_t>(tiff, at + 2, 4);
    put<std::uint32_t>(tiff, at + 8, value);
  }
  return tiff;
}

double hills(int c, int r) { return 400 + 100 * std::sin(c * 0.3) + 80 * std::cos(r * 0.2); }

Spec plain() {
  Spec spec;
  spec.columns = spec.rows = 48, spec.value = hills, spec.nodata = -9999;
  return spec;
}

BadRow tif(std::string name, std::string bytes) { return {std::move(name), "dem.tif", std::move(bytes), plain_options()}; }

}  // namespace

std::vector<BadRow> cut_rows(const Maker& make) {
  struct Kind {
    const char* name;
    const char* file;
    std::vector<std::string> create;
    const char* driver;
    const char* type;
  };
  const std::vector<Kind> kinds = {
      {"stripes", "dem.tif", {}, "GTiff", "Float32"},
      {"deflate tiles", "dem.tif", {"COMPRESS=DEFLATE", "TILED=YES", "BLOCKXSIZE=16", "BLOCKYSIZE=16"}, "GTiff", "Float32"},
      {"lzw predictor 2", "dem.tif", {"COMPRESS=LZW", "PREDICTOR=2"}, "GTiff", "Int16"},
      {"bigtiff", "dem.tif", {"BIGTIFF=YES"}, "GTiff", "Float64"},
      {"big-endian", "dem.tif", {"ENDIANNESS=BIG"}, "GTiff", "UInt16"},
      {"packbits", "dem.tif", {"COMPRESS=PACKBITS"}, "GTiff", "Byte"},
      {"ascii grid", "dem.asc", {}, "AAIGrid", "Float32"},
      {"netcdf", "dem.nc", {}, "netCDF", "Float32"},
      {"netcdf-4", "dem.nc", {"FORMAT=NC4", "COMPRESS=DEFLATE"}, "netCDF", "Float32"},
      {"img", "dem.img", {}, "HFA", "Float32"},
      {"compressed img", "dem.img", {"COMPRESSED=YES"}, "HFA", "Int16"},
      {"geopackage", "dem.gpkg", {"TILE_FORMAT=TIFF"}, "GPKG", "Float32"},
      {"jpeg 2000", "dem.jp2", {"REVERSIBLE=YES", "QUALITY=100"}, "JP2OpenJPEG", "Int16"},
  };
  std::vector<BadRow> rows;
  for (const Kind& kind : kinds) {
    Spec spec = plain();
    spec.create = kind.create, spec.driver = kind.driver, spec.type = kind.type;
    if (spec.type == "Byte") spec.nodata = 0, spec.value = [](int c, int r) { return 1 + (c + r) % 200; };
    if (spec.type == "UInt16") spec.nodata = 0;
    const std::string good = make(spec, kind.file);
    for (const int percent : {1, 5, 20, 50, 80, 99}) {
      rows.push_back({std::string(kind.name) + " cut at " + std::to_string(percent) + " %", kind.file,
                      good.substr(0, good.size() * static_cast<std::size_t>(percent) / 100), plain_options()});
      if (spec.driver == "AAIGrid"s) rows.back().options.set_crs("EPSG:4326");
    }
  }
  return rows;
}

std::vector<BadRow> sent_bad_rows() {
  std::vector<BadRow> rows;
  const auto points = [&](const std::string& name, const std::string& text) {
    rows.push_back({"xyz: " + name, "dem.xyz", text, plain_options()});
    rows.back().options.set_crs("EPSG:32632");
  };
  const std::string line = "500000 5300000 1\n500001 5300000 2\n500002 5300000 3\n";
  points("one line", line.substr(0, 17));
  points("a column is missing", "500000 5300000\n500001 5300000\n500002 5300000\n");
  points("words for numbers", "a b c\nd e f\ng h i\n");
  points("words after numbers", line + "one two three\n");
  points("points anywhere", "500000 5300000 1\n500017 5300003 2\n500001.37 5299000 3\n499000 5300000.1 4\n");
  points("two points far apart", "0 0 1\n0.001 0 2\n1000000 0 3\n0 1000 1\n0.001 1000 2\n1000000 1000 3\n");
  points("nan and inf", "500000 5300000 nan\n500001 5300000 inf\n500000 5300001 1\n500001 5300001 1e999\n");
  points("a line of a megabyte", line + std::string(1 << 20, '1') + "\n");
  const std::string header =
      "BYTEORDER I\nLAYOUT BIL\nNROWS 4\nNCOLS 4\nNBANDS 1\nNBITS 16\nULXMAP 10\nULYMAP 45\nXDIM 0.1\nYDIM 0.1\n";
  rows.push_back({"bil without its header", "dem.bil", std::string(32, '\1'), plain_options()});
  rows.push_back({"header without its bil", "dem.hdr", header, plain_options()});
  rows.push_back({"ers without its data", "dem.ers", "DatasetHeader Begin\nDatasetHeader End\n", plain_options()});
  rows.push_back({"netcdf: a header of ones", "dem.nc", "CDF\1" + std::string(300, '\xff'), plain_options()});
  rows.push_back({"netcdf: hdf5 of zeros", "dem.nc", "\x89HDF\r\n\x1a\n" + std::string(500, '\0'), plain_options()});
  rows.push_back({"sqlite of zeros", "dem.gpkg", "SQLite format 3\0"s + std::string(500, '\0'), plain_options()});
  rows.push_back({"jpeg 2000 of zeros", "dem.jp2", "\0\0\0\x0cjP  \r\n\x87\n"s + std::string(500, '\0'), plain_options()});
  rows.push_back({"img of zeros", "dem.img", "EHFA_HEADER_TAG\0"s + std::string(500, '\0'), plain_options()});
  rows.push_back({"dted of blanks", "dem.dt1", "UHL1" + std::string(4000, ' '), plain_options()});
  rows.push_back({"zip of zeros", "dem.zip", "PK\x03\x04" + std::string(500, '\0'), plain_options()});
  rows.push_back({"gz of zeros", "dem.tif.gz", "\x1f\x8b" + std::string(500, '\0'), plain_options()});
  return rows;
}

std::vector<BadRow> tag_rows(const Maker& make) {
  const std::string good = make(plain(), "dem.tif");
  std::vector<BadRow> rows;
  for (const std::size_t at : entries(good)) {
    const std::string tag = "tag " + std::to_string(get<std::uint16_t>(good, at));
    const auto add = [&](const char* what, const std::function<void(std::string&)>& harm) {
      std::string bytes = good;
      harm(bytes);
      rows.push_back(tif(tag + ": " + what, std::move(bytes)));
    };
    add("type 0", [&](std::string& b) { put<std::uint16_t>(b, at + 2, 0); });
    add("type 5 (rational)", [&](std::string& b) { put<std::uint16_t>(b, at + 2, 5); });
    add("count 2^32 - 1", [&](std::string& b) { put<std::uint32_t>(b, at + 4, 0xffffffff); });
    add("value 0", [&](std::string& b) { put<std::uint32_t>(b, at + 8, 0); });
    add("value 2^32 - 1", [&](std::string& b) { put<std::uint32_t>(b, at + 8, 0xffffffff); });
    add("lowest bit of the value", [&](std::string& b) { b[at + 8] = static_cast<char>(b[at + 8] ^ 1); });
    add("left out", [&](std::string& b) { put<std::uint16_t>(b, at, 60000); });
  }
  return rows;
}

std::vector<BadRow> size_rows(const Maker& make) {
  const std::string good = make(plain(), "dem.tif");
  Spec tiled_spec = plain();
  tiled_spec.create = {"TILED=YES", "BLOCKXSIZE=16", "BLOCKYSIZE=16", "COMPRESS=DEFLATE"};
  const std::string tiled = make(tiled_spec, "dem.tif");
  std::vector<BadRow> rows;
  const auto set = [&](const std::string& from, const char* what, std::uint16_t tag, std::vector<std::uint32_t> values) {
    for (const std::uint32_t value : values)
      rows.push_back(tif(std::string(what) + " " + std::to_string(value), with_tag(from, tag, value)));
  };
  set(good, "width", 256, {1, 65535, 0x7fffffff, 0x80000000});
  set(good, "height", 257, {1, 65535, 0x7fffffff, 0x80000000});
  set(good, "bits a sample", 258, {1, 3, 8, 16, 64, 128, 65535});
  set(good, "compression", 259, {2, 5, 7, 8, 32773, 34887, 34925, 50000, 50001, 12345});
  set(good, "samples a pixel", 277, {2, 3, 1000, 65535});
  set(good, "rows a strip", 278, {1, 7, 1000000});
  set(good, "planar configuration", 284, {2, 3});
  set(good, "sample format", 339, {1, 2, 4, 5, 6, 77});
  set(tiled, "tile width", 322, {0, 1, 15, 65536, 0x40000000, 0xfffffff0});
  set(tiled, "tile height", 323, {0, 1, 15, 65536, 0x40000000});
  set(tiled, "predictor", 317, {2, 3, 99});
  const auto link = [&](const char* what, std::uint32_t to) {
    std::string bytes = good;
    put<std::uint32_t>(bytes, next_directory(bytes), to);
    rows.push_back(tif(what, bytes));
  };
  link("directory that follows itself", get<std::uint32_t>(good, 4));
  link("next directory in the header", 2);
  link("next directory beyond the end", 0x7ffffff0);
  std::string first = good;
  put<std::uint32_t>(first, 4, 0);
  rows.push_back(tif("first directory at 0", first));
  put<std::uint32_t>(first, 4, 0xfffffff0);
  rows.push_back(tif("first directory beyond the end", first));
  std::string many = good;  // each one an empty directory that names the next
  put<std::uint32_t>(many, next_directory(good), static_cast<std::uint32_t>(many.size()));
  for (int k = 0; k < 20000; ++k) {
    const auto next = static_cast<std::uint32_t>(many.size() + 6);
    many += "\0\0"s + std::string(reinterpret_cast<const char*>(&next), 4);
  }
  rows.push_back(tif("20000 empty directories", many));
  return rows;
}

std::vector<BadRow> place_rows(const Maker& make) {
  std::vector<BadRow> rows;
  const auto add = [&](const std::string& name, const std::function<void(Spec&)>& change,
                       const std::function<void(proto::BuildOptions&)>& ask = nullptr) {
    Spec spec = plain();
    change(spec);
    rows.push_back(tif(name, make(spec, "dem.tif")));
    if (ask) ask(rows.back().options);
  };
  const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinite, 0.0, 1e300, 1e-300, 1e9}) {
    char value[32];
    std::snprintf(value, sizeof value, "%g", bad);
    add("pixel width "s + value, [bad](Spec& s) { s.geotransform[1] = bad; });
    add("pixel height "s + value, [bad](Spec& s) { s.geotransform[5] = -bad; });
    add("origin "s + value, [bad](Spec& s) { s.geotransform[0] = bad; });
  }
  add("rotation only", [](Spec& s) { s.geotransform = {10, 0, 0.01, 45, 0.01, 0}; });
  add("sheared flat", [](Spec& s) { s.geotransform = {10, 0.01, 0.01, 45, 0.01, 0.01}; });
  for (const char* crs : {"EPSG:4978", "EPSG:5711", "EPSG:32632", "EPSG:3031", "EPSG:3857", "EPSG:2056",
                          "LOCAL_CS[\"nowhere\",UNIT[\"metre\",1]]", "+proj=merc +a=1737400 +b=1737400 +units=m",
                          "+proj=geos +h=35785831 +ellps=GRS80", "+proj=utm +zone=32 +units=us-ft +ellps=intl",
                          "+proj=longlat +a=3396190 +b=3376200", "+proj=ob_tran +o_proj=longlat +o_lat_p=30 +R=6371229"}) {
    add("degrees labelled " + std::string(crs), [crs](Spec& s) { s.crs = crs; });
  }
  for (const char* unit : {"furlong", "degree", "\xff\xfe", "m/s"})
    add("unit " + std::string(unit), [unit](Spec& s) { s.unit = unit; });
  for (const double bad : {nan, infinite, 1e300}) {
    add("scale " + std::to_string(bad).substr(0, 8), [bad](Spec& s) { s.scale = bad; });
    add("offset " + std::to_string(bad).substr(0, 8), [bad](Spec& s) { s.offset = bad; });
    add("nodata " + std::to_string(bad).substr(0, 8), [bad](Spec& s) { s.nodata = bad; });
    add("all values " + std::to_string(bad).substr(0, 8), [bad](Spec& s) { s.value = [bad](int, int) { return bad; }; });
  }
  add("all nodata", [](Spec& s) { s.value = [](int, int) { return -9999; }; });
  add("one valid pixel", [](Spec& s) { s.value = [](int c, int r) { return c == 7 && r == 7 ? 1 : -9999; }; });
  add("one pixel", [](Spec& s) { s.columns = s.rows = 1; });
  add("no CRS", [](Spec& s) { s.crs = ""; });
  add("no place", [](Spec& s) { s.georeferenced = false; });
  add("two bands", [](Spec& s) { s.bands = 2; });
  add("complex pixels", [](Spec& s) { s.type = "CFloat32"; });
  add(
      "crs= that is a file", [](Spec& s) { s.crs = ""; }, [](proto::BuildOptions& o) { o.set_crs("/etc/passwd"); });
  add(
      "crs= that nests 20000 deep", [](Spec& s) { s.crs = ""; },
      [](proto::BuildOptions& o) {
        std::string wkt;
        for (int k = 0; k < 20000; ++k) wkt += "PROJCRS[";
        o.set_crs(wkt);
      });
  add(
      "crs= with a pipeline", [](Spec& s) { s.crs = ""; },
      [](proto::BuildOptions& o) { o.set_crs("+proj=pipeline +step +proj=axisswap +order=2,1"); });
  add(
      "bbox= elsewhere", [](Spec&) {},
      [](proto::BuildOptions& o) {
        for (const double d : {100.0, 10.0, 110.0, 20.0}) o.add_bbox(d);
      });
  add(
      "vertical datum nobody knows", [](Spec&) {}, [](proto::BuildOptions& o) { o.set_vertical_datum("EGM1066"); });
  return rows;
}

std::vector<BadRow> text_rows() {
  std::vector<BadRow> rows;
  const auto add = [&](const std::string& name, const std::string& file, const std::string& bytes) {
    rows.push_back({name, file, bytes, plain_options()});
    if (file.ends_with(".asc")) rows.back().options.set_crs("EPSG:4326");
  };
  const auto grid = [](const std::string& columns, const std::string& lines, const std::string& cell, const std::string& values) {
    return "ncols " + columns + "\nnrows " + lines + "\nxllcorner 10\nyllcorner 46\ncellsize " + cell + "\nNODATA_value -9999\n" +
           values + "\n";
  };
  const std::string nine = "1 2 3\n4 5 6\n7 8 9";
  for (const char* columns : {"0", "-3", "2147483648", "99999999999999999999", "three", "3.5", ""})
    add("ascii: ncols " + std::string(columns), "dem.asc", grid(columns, "3", "0.1", nine));
  for (const char* cell : {"0", "-0.1", "nan", "inf", "1e308", "1e-308", "x"})
    add("ascii: cellsize " + std::string(cell), "dem.asc", grid("3", "3", cell, nine));
  add("ascii: words for numbers", "dem.asc", grid("3", "3", "0.1", "a b c d e f g h i"));
  add("ascii: nan and inf", "dem.asc", grid("3", "3", "0.1", "nan inf -inf 1e999 -1e999 1 2 3 4"));
  add("ascii: one value too few", "dem.asc", grid("3", "3", "0.1", "1 2 3 4 5 6 7 8"));
  add("ascii: zeros in between", "dem.asc", grid("3", "3", "0.1", "1 2 3\0\0\0 4 5 6 7 8 9"s));
  add("ascii: a line of a megabyte", "dem.asc", grid("3", "3", "0.1", std::string(1 << 20, '1')));
  add("ascii: header alone", "dem.asc", "ncols 3\n");
  add("empty", "dem.tif", "");
  add("one byte", "dem.tif", "I");
  add("eight bytes", "dem.tif", "II*\0\b\0\0\0"s);
  add("zeros", "dem.tif", std::string(4096, '\0'));
  add("text", "dem.tif", "This is no raster.\n");
  add("VRT of a file here", "dem.vrt",
      "<VRTDataset rasterXSize=\"8\" rasterYSize=\"8\"><VRTRasterBand dataType=\"Float32\" band=\"1\"><SimpleSource>"
      "<SourceFilename>/etc/passwd</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>");
  add("VRT of an address", "dem.vrt",
      "<VRTDataset rasterXSize=\"8\" rasterYSize=\"8\"><VRTRasterBand dataType=\"Float32\" band=\"1\"><SimpleSource>"
      "<SourceFilename>/vsicurl/http://127.0.0.1:9/x.tif</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>");
  add("VRT behind blanks, called a TIFF", "dem.tif", std::string(300, ' ') + "<VRTDataset rasterXSize=\"8\" rasterYSize=\"8\"/>");
  std::string bomb = "<?xml version=\"1.0\"?><!DOCTYPE a [<!ENTITY b \"bbbbbbbbbb\">";
  for (char c = 'c'; c < 'm'; ++c)
    bomb += std::string("<!ENTITY ") + c + " \"" + [&] {
      std::string ten;
      for (int k = 0; k < 10; ++k) ten += std::string("&") + static_cast<char>(c - 1) + ";";
      return ten;
    }() + "\">";
  add("XML whose entities grow to gigabytes", "dem.xml", bomb + "]><a>&l;</a>");
  add("XML that names a file", "dem.gml",
      "<?xml version=\"1.0\"?><!DOCTYPE a [<!ENTITY f SYSTEM \"file:///etc/passwd\">]><a>&f;</a>");
  add("WMS description of an address", "dem.tif",
      "<GDAL_WMS><Service name=\"TMS\"><ServerUrl>http://127.0.0.1:9/${z}</ServerUrl></Service></GDAL_WMS>");
  add("/vsicurl as a name", "vsicurl_http.tif", "/vsicurl/http://127.0.0.1:9/dem.tif");
  add("JSON of a STAC tile", "dem.json", "{\"type\":\"FeatureCollection\",\"features\":[]}");
  add(".hgt of a wrong size", "N44W072.hgt", std::string(1000, '\1'));
  add(".hgt with a name that is no place", "dem.hgt", std::string(2 * 1201 * 1201, '\1'));
  add(".hgt of a place beyond the earth", "N99W999.hgt", std::string(2 * 1201 * 1201, '\1'));
  add("USGS DEM of blanks", "x.dem", std::string(3000, ' '));
  return rows;
}

}  // namespace cordillera::raster_test
