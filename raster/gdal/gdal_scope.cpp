#include "raster/gdal/gdal_scope.h"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <gdal.h>
#include <ogr_srs_api.h>

#include <mutex>
#include <string_view>
#include <utility>

#include "proto/paths.h"
#include "proto/utf8.h"
#include "raster/gdal/proj_context.h"

namespace cordillera::raster {
namespace {

constexpr GIntBig kBlockCache_bytes = GIntBig{128} << 20;

void start_gdal() {
  GDALAllRegister();
  // Grids fetched over the network would make tiles depend on the day's connection.
  OSRSetPROJEnableNetwork(0);
  // GDAL's default is a share of the machine's memory; ours must not grow with the machine or with the raster.
  if (CPLGetConfigOption("GDAL_CACHEMAX", nullptr) == nullptr) GDALSetCacheMax64(kBlockCache_bytes);
  // A storage that does not answer is an error after a while; GDAL by itself waits for ever.
  for (const auto& [key, value] : {std::pair{"GDAL_HTTP_CONNECTTIMEOUT", "10"},
                                   {"GDAL_HTTP_LOW_SPEED_TIME", "20"},
                                   {"GDAL_HTTP_LOW_SPEED_LIMIT", "1"},
                                   // JPEG 2000 would start a thread a core for each source; builds have threads of their own.
                                   {"GDAL_NUM_THREADS", "1"}}) {
    if (CPLGetConfigOption(key, nullptr) == nullptr) CPLSetConfigOption(key, value);
  }
}

thread_local int g_scopes = 0;

void listen(CPLErr kind, CPLErrorNum, const char* message) {
  constexpr std::string_view kOfProj = "PROJ: ";
  const std::string_view said = message;
  if (said.starts_with(kOfProj)) hear_proj(said.substr(kOfProj.size()), kind >= CE_Failure ? Said::as_error : Said::aside);
}

struct Setting {
  const char* key;
  const char* value;
  bool posted_only;
};
constexpr std::array<Setting, GdalScope::kSettingCount> kSettings{{
    // GeoTIFF 1.0 files name their vertical CRS only on request; without it a declared datum would be lost.
    {"GTIFF_REPORT_COMPD_CS", "YES", false},
    // NetCDF coordinates whose attributes do not say that they are some: with a CRS that the user names they place the raster.
    {"GDAL_NETCDF_IGNORE_XY_AXIS_NAME_CHECKS", "YES", false},
    // What PROJ says aside reaches listen() only so: of a compound CRS it tells nowhere else that its tables could not be read.
    {"CPL_DEBUG", "PROJ", false},
    {"GDAL_DISABLE_READDIR_ON_OPEN", "EMPTY_DIR", true},
    {"GDAL_PAM_ENABLED", "NO", true},
    // A world file beside a posted TIFF would be somebody else's. (As an option of Open the other drivers would complain of it.)
    {"GDAL_GEOREF_SOURCES", "INTERNAL", true},
}};

}  // namespace

GdalScope::GdalScope(Trust trust) {
  static std::once_flag once;
  std::call_once(once, start_gdal);
  if (g_scopes++ == 0) forget_proj();
  CPLPushErrorHandler(listen);
  CPLErrorReset();
  for (std::size_t k = 0; k < kSettings.size(); ++k) {
    const Setting& setting = kSettings[k];
    if (const char* before = CPLGetThreadLocalConfigOption(setting.key, nullptr)) before_[k] = before, was_set_[k] = true;
    if (!setting.posted_only || trust == Trust::posted_file) CPLSetThreadLocalConfigOption(setting.key, setting.value);
  }
}

GdalScope::~GdalScope() {
  for (std::size_t k = 0; k < kSettings.size(); ++k)
    CPLSetThreadLocalConfigOption(kSettings[k].key, was_set_[k] ? before_[k].c_str() : nullptr);
  CPLPopErrorHandler();
  --g_scopes;
}

bool GdalScope::tables_failed() const { return proj_tables_failed(); }

bool GdalScope::failed() const { return CPLGetLastErrorType() >= CE_Failure; }

std::string GdalScope::message(const std::string& path, const std::string& name) const {
  return proto::shown_text(proto::without_path(CPLGetLastErrorMsg(), path, name));  // drivers quote what they do not understand
}

}  // namespace cordillera::raster
