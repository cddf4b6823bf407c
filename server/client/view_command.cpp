// A service of its own for as long as somebody looks: on this machine's loopback, at a free port, with a data folder that goes
// with it.
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>

#include "pipeline/exports/mbtiles.h"
#include "pipeline/exports/unpack_tiles.h"
#include "raster/archive/archive.h"
#include "raster/disk/free_space.h"
#include "raster/disk/private_folder.h"
#include "server/cli/path_kind.h"
#include "server/client/commands.h"
#include "server/datasets/upload.h"
#include "server/limits/disk.h"
#include "server/options/options.h"
#include "server/sandbox/asked_to_stop.h"

namespace cordillera::server::client {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "manifest.json";  // of a folder of tiles

/// The desktop's browser, where there is a desktop; in a session of its own, so that Ctrl+C here does not end it.
void open_browser(const std::string& address) {
  if (getenv("DISPLAY") == nullptr && getenv("WAYLAND_DISPLAY") == nullptr) return;
  std::string program = "xdg-open", word = address;
  char* words[] = {program.data(), word.data(), nullptr};
  posix_spawnattr_t apart;
  posix_spawn_file_actions_t silent;
  posix_spawnattr_init(&apart);
  posix_spawnattr_setflags(&apart, POSIX_SPAWN_SETSID);
  posix_spawn_file_actions_init(&silent);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&silent, stream, "/dev/null", O_RDWR, 0);
  pid_t child = 0;
  posix_spawnp(&child, program.c_str(), &silent, &apart, words, environ);
  posix_spawn_file_actions_destroy(&silent);
  posix_spawnattr_destroy(&apart);
}

proto::Problem no_folder() { return {"output-failed", "no temporary folder can be made", "a TMPDIR that can be written", ""}; }

/// What the service is to show, and what is to be posted to it first.
struct Subjects {
  std::vector<Mount> mounts;
  std::vector<std::string> maps;  ///< of the mounts, those that a page for maps shows
  std::vector<std::string> rasters;
  std::vector<std::unique_ptr<raster::PrivateFolder>> unpacked;  ///< what archives hold
};

/// A .3tz, or a zip of a folder of tiles, as that folder. Null: it is none.
proto::Result<std::unique_ptr<raster::PrivateFolder>> unpacked(const std::string& path) {
  auto folder = std::make_unique<raster::PrivateFolder>();
  if (!folder->made()) return no_folder();
  const auto found = raster::unpack_folder(path, fs::path(path).filename().string(), kManifest, *folder, &g_asked_to_stop);
  if (!found) return found.problem();
  if (!*found) folder = nullptr;
  return folder;
}

/// A .pmtiles or .mbtiles, as such a folder.
proto::Result<std::unique_ptr<raster::PrivateFolder>> unpacked_tiles(const std::string& path) {
  auto folder = std::make_unique<raster::PrivateFolder>();
  if (!folder->made()) return no_folder();
  if (const auto done = pipeline::exports::unpack_tiles(path, folder->path(), &g_asked_to_stop); !done) return done.problem();
  return folder;
}

/// Whether a folder of tiles has what a map shows and nothing that the viewer does, which takes 3D Tiles.
bool is_for_maps(const std::string& folder) {
  const auto has = [&](std::string_view file) {
    std::error_code error;
    return fs::exists(fs::path(folder) / file, error);
  };
  const auto all = pipeline::faces::all_faces();
  return has(kManifest) && !has("tileset.json") && std::any_of(all.begin(), all.end(), [&](const pipeline::faces::Face* face) {
           return pipeline::exports::fits_mbtiles(*face) && has(face->entry);
         });
}

/// "out/My DEM.sqlite" -> "my-dem"; of a folder, its own name.
std::string id_of(const std::string& path) {
  const std::string id = id_stem((fs::absolute(path) / "").lexically_normal().parent_path().filename().string());
  return id.empty() ? "terrain" : id;
}

proto::Result<Subjects> subjects_of(const std::vector<std::string>& paths) {
  Subjects subjects;
  std::error_code nowhere;  // then no folder is made there either
  raster::keep_free(limits::bytes_to_leave(fs::temp_directory_path(nowhere), Limits().free_percent));
  for (const std::string& path : paths) {
    const PathKind kind = path_kind(path);
    if (kind == PathKind::missing) {
      return proto::Problem{
          "file-unreadable", "there is no " + path,
          "a raster, a dataset's .sqlite file, a .3tz, .pmtiles or .mbtiles, or a folder that `cordillera build` wrote", "path"};
    }
    if (kind == PathKind::folder && holds_rasters(path)) {
      return proto::Problem{"file-unreadable", path + " holds rasters, and nothing that was built of them",
                            "cordillera build " + path + " -o terrain.sqlite, and then cordillera view terrain.sqlite", "path"};
    }
    std::string shown = path;
    const bool tiles = kind != PathKind::folder && pipeline::exports::is_tile_archive(path);
    if (tiles || kind == PathKind::raster) {
      auto folder = tiles ? unpacked_tiles(path) : unpacked(path);
      if (!folder) return folder.problem();
      if (!*folder) {
        subjects.rasters.push_back(path);
        continue;
      }
      shown = (*folder)->path();
      subjects.unpacked.push_back(std::move(*folder));
    }
    const std::string id = id_of(path);
    std::string name = id;
    const auto taken = [&](const Mount& other) { return other.name == name; };
    for (int n = 2; std::any_of(subjects.mounts.begin(), subjects.mounts.end(), taken); ++n) name = id + "-" + std::to_string(n);
    subjects.mounts.push_back({name, shown});
    if (is_for_maps(shown)) subjects.maps.push_back(name);
  }
  return subjects;
}

/// Posts the rasters, says where the terrain is, and ends the service if there is none.
class Guide {
 public:
  Guide(const ViewLine& line, const Subjects& subjects) : line_(line), subjects_(subjects) {}
  ~Guide() {
    if (thread_.joinable()) thread_.join();
  }
  Guide(const Guide&) = delete;
  Guide& operator=(const Guide&) = delete;

  void listening(int port) {
    thread_ = std::thread([this, port] { guide("http://127.0.0.1:" + std::to_string(port)); });
  }
  bool failed() const { return failed_; }
  bool busy() const { return busy_; }

 private:
  void guide(const std::string& address) {
    if (subjects_.rasters.empty()) return tell(address);
    busy_ = true;
    PostLine post;
    post.place.server = address;
    post.rasters = subjects_.rasters;
    post.options = line_.options;
    post.accepted = [&] { tell(address); };  // a first look comes long before the end of the build
    post.after = After::wait;
    post.show = Show::problems;
    failed_ = post_command(post) != kDone;
    busy_ = false;
    if (failed_) kill(getpid(), SIGTERM);
  }

  void tell(const std::string& address) const {
    std::vector<std::string> pages;
    const auto& maps = subjects_.maps;
    const auto shown = std::find_if(subjects_.mounts.begin(), subjects_.mounts.end(), [&](const Mount& mount) {
      return std::find(maps.begin(), maps.end(), mount.name) == maps.end();
    });
    // The viewer would begin with the first of the list.
    if (shown != subjects_.mounts.end() && !maps.empty())
      pages.push_back(address + "/?dataset=" + shown->name);
    else if (shown != subjects_.mounts.end() || !subjects_.rasters.empty())
      pages.push_back(address + "/");
    for (const std::string& name : maps) pages.push_back(address + "/v1/datasets/" + name + "/demo/maplibre.html");
    for (const std::string& page : pages) std::cout << page << "\n";
    std::cout << "Ctrl+C ends it" << std::endl;
    if (line_.browser == Browser::opens) open_browser(pages.front());
  }

  const ViewLine& line_;
  const Subjects& subjects_;
  std::thread thread_;
  std::atomic<bool> failed_{false}, busy_{false};
};

}  // namespace

int view_command(const ViewLine& line, const std::string& program) {
  raster::remove_left_folders();
  // Until the service has handlers of its own: what is unpacked goes with its folder, and no handler could remove that.
  stop_on({SIGINT, SIGTERM, SIGHUP}, SecondTime::ends);
  auto subjects = subjects_of(line.paths);
  if (!subjects) return fail(subjects.problem());
  std::optional<raster::PrivateFolder> data(std::in_place);
  if (!data->made()) return fail(no_folder());
  Settings settings;
  settings.serve.listen = "127.0.0.1:" + (line.port.empty() ? "0" : line.port);
  settings.serve.data = data->path();
  settings.serve.log_level = "error";  // a build that fails is told by who posted it
  settings.serve.mounts = subjects->mounts;
  Guide guide(line, *subjects);
  const int code = serve_command(settings, program, [&guide](int port) {
    if (g_asked_to_stop) return static_cast<void>(kill(getpid(), SIGTERM));  // it came before there was a service to end
    guide.listening(port);
  });
  if (guide.busy()) {  // it would go on asking a service that is over
    data.reset();
    subjects->unpacked.clear();
    std::_Exit(with_output(code));
  }
  return guide.failed() ? kFailed : code;
}

}  // namespace cordillera::server::client
