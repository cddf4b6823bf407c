// Rasters that GDAL reads from a server: what the server says is told, and nobody's raster is called bad for it.
#include <gmock/gmock.h>
#include <httplib.h>

#include <filesystem>
#include <mutex>
#include <thread>

#include "program_fixture.h"
#include "tests/raster/sent.h"

namespace cordillera::server {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

/// Gives files of a folder, whole or in parts; once `status` is not 200, after so many answers that alone.
class FileHost {
 public:
  explicit FileHost(std::filesystem::path folder) : folder_(std::move(folder)) {
    server_.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& answer) {
      const std::lock_guard lock(mutex_);
      const auto file = folder_ / std::filesystem::path(request.path).filename();
      const bool there = std::filesystem::is_regular_file(file);
      answer.status = !there ? 404 : well_-- > 0 ? 200 : status_;
      if (answer.status != 200) return httplib::Server::HandlerResponse::Handled;
      if (whole_) const_cast<httplib::Request&>(request).ranges.clear();
      if (!request.ranges.empty()) answer.status = 206;
      answer.set_content(file_text(file.string()), "application/octet-stream");
      return httplib::Server::HandlerResponse::Handled;
    });
    address_ = "http://127.0.0.1:" + std::to_string(server_.bind_to_any_port("127.0.0.1")) + "/";
    serving_ = std::thread([this] { server_.listen_after_bind(); });
    while (!server_.is_running()) std::this_thread::yield();
  }
  ~FileHost() {
    server_.stop();
    serving_.join();
  }
  const std::string& address() const { return address_; }
  void answers(int status, int after = 0) {
    const std::lock_guard lock(mutex_);
    status_ = status, well_ = after;
  }
  void gives_whole_files_only() {
    const std::lock_guard lock(mutex_);
    whole_ = true;
  }

 private:
  const std::filesystem::path folder_;
  httplib::Server server_;
  std::string address_;
  std::thread serving_;
  std::mutex mutex_;
  int status_ = 200, well_ = 0;
  bool whole_ = false;
};

class RemoteRaster : public Program {
 protected:
  Ended built(const std::string& sources, const std::string& more = "") {
    return shell(kProgram + " build " + sources + " --crs EPSG:4326 --vertical-datum ellipsoid --error 50 --max-level 9 -q " +
                 "--overwrite -o " + (folder_.path() / "out.sqlite").string() + " " + more);
  }
  FileHost host_{folder_.path()};
};

TEST_F(RemoteRaster, WhatItsServerSaysIsTold) {
  EXPECT_EQ(built(host_.address() + "cone.asc").code, 0);
  const Ended missing = built(host_.address() + "none.asc");
  EXPECT_EQ(missing.output, "cordillera: none.asc is not there\n");
  for (const int status : {401, 403, 500, 503}) {
    host_.answers(status);
    const Ended refused = built(host_.address() + "cone.asc");
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.output, AllOf(HasSubstr("cone.asc cannot be read: its server answers " + std::to_string(status)),
                                      Not(HasSubstr("gdal_translate")), Not(HasSubstr("damaged"))));
  }
  EXPECT_THAT(built("http://127.0.0.1:1/cone.asc").output,
              AllOf(HasSubstr("cone.asc cannot be read"), Not(HasSubstr("GeoTIFF"))));
}

/// GDAL takes a small file as a whole.
TEST_F(RemoteRaster, AServerWithoutPartsIsNoOtherFormat) {
  std::ofstream(folder_.path() / "large.asc") << cone() << std::string(500000, '\n');
  host_.gives_whole_files_only();
  EXPECT_THAT(built(host_.address() + "large.asc").output,
              AllOf(HasSubstr("large.asc cannot be read: its server gives whole files only"), Not(HasSubstr("gdal_translate"))));
}

/// GDAL has read the first 16 kB of it.
TEST_F(RemoteRaster, AServerThatFailsLaterDamagesNothing) {
  int told = 0;
  for (const int after : {1, 2, 3, 4, 5}) {
    host_.answers(500, after);
    const Ended ended = built(host_.address() + "cone.asc");
    if (ended.code == 0) continue;
    ++told;
    EXPECT_THAT(ended.output, AllOf(HasSubstr("cone.asc cannot be read: its server answers 500"), Not(HasSubstr("damaged"))))
        << after;
  }
  EXPECT_GT(told, 1);
}

TEST_F(RemoteRaster, OfAVrtTheServerIsTold) {
  const std::string vrt = (folder_.path() / "all.vrt").string();
  std::ofstream(vrt)
      << "<VRTDataset rasterXSize=\"64\" rasterYSize=\"64\"><SRS>EPSG:4326</SRS><GeoTransform>10,0.008,0,47,0,-0.008"
      << "</GeoTransform><VRTRasterBand dataType=\"Float32\" band=\"1\"><SimpleSource><SourceFilename>/vsicurl/"
      << host_.address() << "cone.asc</SourceFilename><SourceBand>1</SourceBand><SourceProperties RasterXSize=\"64\" "
      << "RasterYSize=\"64\" DataType=\"Float32\" BlockXSize=\"64\" "
         "BlockYSize=\"1\"/></SimpleSource></VRTRasterBand></VRTDataset>";
  EXPECT_EQ(built(vrt).code, 0);
  host_.answers(503);
  // Of several threads' errors GDAL's last one may name the VRT alone.
  EXPECT_THAT(built(vrt).output,
              AnyOf(StartsWith("cordillera: cone.asc cannot be read: its server answers 503; accepted: a file"),
                    StartsWith("cordillera: all.vrt cannot be read: its server answers 503; accepted: a file")));
}

TEST_F(RemoteRaster, WhatCannotBeFetchedNowIsNotLeftOutAsBad) {
  const std::string both = raster_ + " " + host_.address() + "cone.asc";
  host_.answers(503);
  const Ended refused = built(both, "--skip-bad");
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.output, HasSubstr("its server answers 503"));
  const Ended without = built(raster_ + " " + host_.address() + "none.asc", "--skip-bad");
  EXPECT_EQ(without.code, 0);
  EXPECT_THAT(without.output, HasSubstr("left out: /vsicurl/" + host_.address() + "none.asc: none.asc is not there"));
}

TEST_F(RemoteRaster, AnArchiveIsFetchedAndUnpacked) {
  raster_test::zip_files((folder_.path() / "cone.zip").string(), {{"cone.asc", raster_}});
  std::ofstream(folder_.path() / "no.gz") << "no archive";
  const auto source_of = [](const Ended& told) { return told.output.substr(0, told.output.find(',')); };
  const auto told = [&](const std::string& raster) {
    return shell(kProgram + " build --dry-run --crs EPSG:4326 --vertical-datum ellipsoid " + raster);
  };
  EXPECT_EQ(source_of(told(host_.address() + "cone.zip")), source_of(told((folder_.path() / "cone.zip").string())));
  EXPECT_THAT(told("/vsizip//vsicurl/" + host_.address() + "cone.zip/cone.asc").output, HasSubstr("64 x 64"));
  EXPECT_THAT(told(host_.address() + "no.gz").output, HasSubstr("no.gz is neither a .zip nor a .gz"));
  EXPECT_THAT(told(host_.address() + "none.zip").output, HasSubstr("none.zip is not there"));
  host_.answers(503);
  EXPECT_THAT(told(host_.address() + "cone.zip").output, HasSubstr("cone.zip cannot be read: its server answers 503"));
}

}  // namespace
}  // namespace cordillera::server
