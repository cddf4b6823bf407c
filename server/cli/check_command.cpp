#include <filesystem>
#include <iostream>
#include <memory>
#include <vector>

#include "pipeline/check/check.h"
#include "pipeline/work/work_plan.h"
#include "raster/mosaic/mosaic_description.h"
#include "server/cli/commands.h"
#include "server/cli/path_kind.h"
#include "server/cli/progress_bar.h"
#include "server/cli/sources.h"
#include "server/data/layout.h"
#include "server/datasets/registry.h"
#include "server/http/json.h"
#include "server/jobs/child.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using pipeline::check::OpenRasters;
using pipeline::check::Report;

Json json_of(const std::string& path, const Report& report) {
  Json json = {{"path", path},
               {"sound", report.sound()},
               {"checksums", report.checksums},
               {"tiles", report.tiles},
               {"borders", report.borders},
               {"measured_tiles", report.measured},
               {"unmeasured_tiles", report.unmeasured},
               {"unreferenced", report.unreferenced},
               {"findings", report.findings.count()}};
  json["first_findings"] = Json::array();
  for (const auto& finding : report.findings.kept())
    json["first_findings"].push_back({{"where", finding.where}, {"what", finding.what}});
  return json;
}

void print(const std::string& path, const Report& report, Verbosity words) {
  if (words == Verbosity::none && report.sound()) return;
  for (const auto& finding : report.findings.kept()) std::cout << path << ": " << finding.where << ": " << finding.what << "\n";
  std::cout << path << ": " << (report.sound() ? "sound" : std::to_string(report.findings.count()) + " findings") << "; "
            << report.checksums << " checksums, " << report.tiles << " tiles decoded, " << report.borders << " borders compared";
  if (report.measured > 0) std::cout << ", " << report.measured << " tiles measured";
  if (report.unmeasured > 0) std::cout << ", " << report.unmeasured << " tiles too large to measure";
  if (report.unreferenced > 0) std::cout << "; " << report.unreferenced << " blobs that no tile names";
  std::cout << "\n";
}

/// The manifest has one datum for all its rasters: where they differ none of their options names it. Each then counts from what
/// it declares; where something else was asked for, the manifest says so of that raster.
proto::Result<void> take_own_datums(const proto::Manifest& manifest, std::vector<raster::MosaicMember>& members) {
  if (static_cast<int>(members.size()) != manifest.sources_size()) return {};  // of another list: it is measured as it is
  for (std::size_t k = 0; k < members.size(); ++k) {
    const proto::Source& stated = manifest.sources(static_cast<int>(k));
    raster::MosaicMember& member = members[k];
    if (stated.file() != member.description.file() || stated.vertical_datum_from() != "request") continue;
    if (stated.vertical_datum() == member.description.vertical_datum()) continue;
    proto::BuildOptions options = member.options;
    options.set_vertical_datum(stated.vertical_datum());
    auto examined = raster::examine(member.path, member.name, member.trust, options);
    if (!examined) return examined.problem();
    member = std::move(*examined);
  }
  return {};
}

/// Read as they were for the dataset.
OpenRasters rasters_of(const std::vector<std::string>& sources) {
  if (sources.empty()) return nullptr;
  return [sources](const proto::Manifest& manifest) -> proto::Result<std::unique_ptr<raster::Source>> {
    Settings settings;
    settings.build = manifest.options();
    const bool mixed = manifest.options().vertical_datum() == raster::kMixed;
    if (mixed) settings.build.clear_vertical_datum();
    auto request = request_of(sources, settings);
    if (!request) return request.problem();
    if (mixed) {
      if (const auto taken = take_own_datums(manifest, request->members); !taken.ok()) return taken.problem();
    }
    return pipeline::open_source(*request);
  };
}

proto::Result<Report> check_one(const fs::path& path, const OpenRasters& rasters, const CheckLine& line) {
  std::error_code error;
  if (path_kind(path.string()) == PathKind::raster)
    return proto::Problem{"store-unknown", path.string() + " is no dataset",
                          "the .sqlite file of a dataset, a folder of tiles, or the data folder of a server", "path"};
  if (fs::exists(path / pipeline::work::kPlanFile, error) && !fs::exists(path / "manifest.json", error))
    return proto::Problem{"store-unknown", path.string() + " is a plan, whose results `cordillera publish` checks",
                          "what publish wrote: a .sqlite file or a folder of tiles", "path"};
  ProgressBar bar(ProgressBar::style_of(line.show == Show::table && line.words == Verbosity::all), kBarPatience);
  const auto told = bar.callback();
  if (!fs::is_directory(path, error)) return pipeline::check::check_store(path.string(), rasters, told);
  if (fs::exists(path / kStoreFile, error)) return pipeline::check::check_store((path / kStoreFile).string(), rasters, told);
  return pipeline::check::check_folder(path.string(), rasters, told);
}

/// Datasets of a server's data folder that should be whole; the server may run.
std::vector<std::string> ready_datasets(const Layout& layout) {
  std::vector<std::string> ids;
  for (const Row& row : Registry::read_only(layout.registry().string())->list()) {
    if (row->state == State::ready) ids.push_back(row->id);
  }
  return ids;
}

/// Says what came out; whether it was sound.
bool tell(const std::string& path, const proto::Result<Report>& report, const CheckLine& line, Json& all) {
  if (line.show == Show::json) {
    all.push_back(
        report ? json_of(path, *report)
               : Json{{"path", path}, {"sound", false}, {"problem", report.problem().type}, {"detail", report.problem().detail}});
  } else if (report) {
    print(path, *report, line.words);
  } else {
    complain(report.problem());
  }
  return report && report->sound();
}

}  // namespace

int check_command(const CheckLine& line) {
  if (const auto closed = refuse_closed(line.path, "path")) return fail(*closed);
  const Layout layout{line.path};
  std::error_code error;
  bool sound = true;
  Json all = Json::array();
  if (fs::exists(layout.registry(), error)) {
    if (!line.sources.empty())
      return wrong_usage({"usage", "--source goes with one dataset, and " + line.path + " is the data folder of a server",
                          "one of the folders in its datasets/", "--source"});
    std::vector<std::string> ids;
    try {
      ids = ready_datasets(layout);
    } catch (const RegistryError& broken) {
      complain({"data-unusable", broken.what(),
                "a data folder whose registry.sqlite can be read; a backup, with cordillera restore", "path"});
      return kFailed;
    }
    for (const std::string& id : ids)
      sound = tell(layout.dataset(id).string(), check_one(layout.store(id), nullptr, line), line, all) && sound;
    if (line.show == Show::table && line.words == Verbosity::all)
      std::cout << line.path << ": " << ids.size() << " datasets that are ready\n";
  } else {
    sound = tell(line.path, check_one(line.path, rasters_of(line.sources), line), line, all);
  }
  if (line.show == Show::json) std::cout << Json{{"sound", sound}, {"datasets", all}}.dump(2) << "\n";
  return sound ? kDone : kFailed;
}

}  // namespace cordillera::server
