#include "raster/gdal/proj_context.h"

#include <cpl_string.h>
#include <ogr_srs_api.h>
#include <proj.h>

#include <sstream>
#include <string>
#include <vector>

#include "raster/disk/geoid_folders.h"

namespace cordillera::raster {
namespace {

thread_local bool g_failed = false;      // the tables, for certain
thread_local bool g_complained = false;  // of anything

void log_of_proj(void*, int level, const char* message) {
  hear_proj(message, level == PJ_LOG_ERROR ? Said::as_error : Said::aside);
}

ProjContext in_folders(const char* const* folders, int count) {
  ProjContext context(proj_context_create());
  proj_log_func(context.get(), nullptr, log_of_proj);
  proj_log_level(context.get(), PJ_LOG_DEBUG);
  proj_context_set_enable_network(context.get(), 0);
  proj_context_set_search_paths(context.get(), count, folders);
  return context;
}

/// As GDAL's contexts are.
ProjContext make_gdals_context() {
  const CPLStringList folders(OSRGetPROJSearchPaths());
  return in_folders(folders.List(), folders.Count());
}

/// A CRS that every installation has, in a context that keeps nothing of what was made before.
bool has_well_known(const ProjContext& context) {
  PJ* const crs = proj_create_from_database(context.get(), "EPSG", "4326", PJ_CATEGORY_CRS, 0, nullptr);
  proj_destroy(crs);
  return crs != nullptr;
}

}  // namespace

void CloseProjContext::operator()(pj_ctx* context) const { proj_context_destroy(context); }

ProjContext make_proj_context() {
  std::vector<std::string> folders;
  for (const auto& folder : geoid_folders()) folders.push_back(folder.string());
  std::istringstream own(proj_info().searchpath == nullptr ? "" : proj_info().searchpath);
  for (std::string folder; std::getline(own, folder, ':');)
    if (!folder.empty()) folders.push_back(folder);
  std::vector<const char*> paths;
  for (const std::string& folder : folders) paths.push_back(folder.c_str());
  return in_folders(paths.data(), static_cast<int>(paths.size()));
}

void hear_proj(std::string_view message, Said how) {
  const auto says = [&](std::string_view words) { return message.find(words) != message.npos; };
  const bool unopened = says("Open of ") && message.ends_with("proj.db failed");
  if (unopened || says("SQLite error on ") || says("Cannot find proj.db")) g_failed = true;
  if (how == Said::as_error) g_complained = true;
}

bool proj_tables_failed() {
  if (!g_failed && g_complained) g_failed = !has_well_known(make_gdals_context()) || !has_well_known(make_proj_context());
  return g_failed;
}

void forget_proj() { g_failed = g_complained = false; }

}  // namespace cordillera::raster
