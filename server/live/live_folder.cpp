#include "server/live/live_folder.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <utility>
#include <vector>

#include "proto/utf8.h"
#include "raster/disk/descriptor.h"
#include "raster/gdal/formats.h"
#include "raster/storage/storage.h"
#include "server/api/api.h"
#include "server/api/api_updates.h"
#include "server/datasets/more_rasters.h"
#include "server/datasets/upload.h"
#include "server/http/json.h"
#include "server/http/request_id.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr auto kPause = std::chrono::seconds(2);
constexpr int kMissedLooks = 2;             // before a file counts as gone: a program may write it anew under its name
constexpr std::size_t kMostFiles = 10'000;  // what a look takes is a fraction of the pause
constexpr std::size_t kPiece = 1 << 20;
constexpr const char* kWho = "live folder";
constexpr const char* kErMapper = ".ers";  // its heights have no extension, by which they could be found

/// Reads a file in pieces; what has become a link meanwhile is not followed. False: it cannot be read, or the sink wants no more.
bool read_pieces(const fs::path& file, const Request::Sink& sink) {
  const raster::Descriptor opened(::open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
  if (!opened.is_open()) return false;
  std::string piece(kPiece, '\0');
  for (;;) {
    const ssize_t count = ::read(opened.number(), piece.data(), kPiece);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return count == 0;
    if (!sink({piece.data(), static_cast<std::size_t>(count)})) return false;
  }
}

/// As if the file were sent. It ends early where the file does.
Request sending(const fs::path& file, const std::string& method, const std::string& path) {
  Request request;
  request.method = method;
  request.path = path;
  request.client = kWho;
  request.id = request_id_of(request);
  request.who = {access::Role::admin, kWho};
  std::error_code error;
  request.headers["content-length"] = std::to_string(fs::file_size(file, error));
  request.read_body = [file](const Request::Sink& sink) { return read_pieces(file, sink); };
  return request;
}

/// What an answer complains of.
std::optional<Problem> refusal(const Response& response) {
  if (response.status < 400) return std::nullopt;
  const Json json = Json::parse(response.bytes(), nullptr, false);
  if (!json.is_object()) return Problem{response.problem, "", "", ""};
  return Problem{response.problem, json.value("detail", ""), json.value("accepted", ""), ""};
}

/// Those that another attempt may find otherwise, if only after the operator has set another limit.
bool is_passing(const Problem& problem) {
  for (const char* type : {"queue-full", "storage-full", "datasets-full", "body-too-large", "too-many-uploads",
                           "service-stopping", "service-busy", "body-incomplete", "memory-limit"}) {
    if (problem.type == type) return true;
  }
  return false;
}

/// The raster that a dataset began with.
std::string first_source(const proto::SourceChanges& changes) {
  for (const auto* list : {&changes.ended(), &changes.pending()}) {
    for (const proto::SourceChange& change : *list) {
      if (change.number() == 1) return change.source().id();
    }
  }
  return "";
}

/// Among the rasters of its dataset that which came of the file; others were added over HTTP. Empty: it is gone, or, where it was
/// not noted, no single one can be it.
std::string own_source(const std::vector<proto::DatasetSource>& sources, const std::string& path, const std::string& noted) {
  if (noted.empty() && sources.size() == 1) return sources.front().id();
  std::vector<std::string> own;
  for (const proto::DatasetSource& source : sources) {
    const bool is_own = noted.empty() ? source.spec().name() == fs::path(path).filename() : source.id() == noted;
    if (is_own) own.push_back(source.id());
  }
  return own.size() == 1 ? own.front() : "";
}

}  // namespace

LiveFolder::LiveFolder(Service& service, fs::path folder, LiveNotes notes)
    : service_(service), folder_(std::move(folder)), notes_(std::move(notes)) {
  if (!known_.empty()) write_notes();  // those of an earlier version did not name the folder
  log_info("rasters in " + fs::absolute(folder_).string() + " are datasets");
  thread_ = std::thread([this] { run(); });
}

LiveFolder::~LiveFolder() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  ending_.notify_all();
  thread_.join();
}

bool LiveFolder::stops() {
  const std::lock_guard lock(mutex_);
  return stop_ || service_.stopping();
}

void LiveFolder::run() {
  while (!stops()) {
    try {
      look();
    } catch (const std::exception& error) {  // the registry's, or want of memory
      log_warning(std::string("live folder: ") + error.what() + "; looked at again");
    }
    std::unique_lock lock(mutex_);
    ending_.wait_for(lock, kPause, [this] { return stop_; });
  }
}

LiveFolder::Files LiveFolder::files() const {
  Files files;
  Prints& found = files.prints;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder_, error);
  for (; !error && entry != fs::recursive_directory_iterator() && found.size() < kMostFiles; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::error_code gone;  // while we look
    const bool is_folder = !entry->is_symlink(gone) && entry->is_directory(gone);
    if (is_folder && !name.starts_with('.') && ::access(entry->path().c_str(), R_OK | X_OK) != 0) {  // lost+found, mostly
      files.closed.push_back(entry->path().lexically_relative(folder_).generic_string() + "/");
      entry.disable_recursion_pending();
      continue;
    }
    if (name.starts_with('.')) {
      if (is_folder) entry.disable_recursion_pending();
      continue;
    }
    const std::string extension = raster::extension_of(name);
    const bool is_raster = raster::is_raster_extension(extension) && extension != kErMapper;
    const bool is_side = raster::is_pam(name) || raster::is_side_extension(extension);
    const bool is_packed = extension == ".zip" || extension == ".gz";
    if (entry->is_symlink(gone) || !entry->is_regular_file(gone) || !(is_raster || is_side || is_packed)) continue;
    const Print print{entry->file_size(gone), entry->last_write_time(gone).time_since_epoch().count()};
    const std::string path = entry->path().lexically_relative(folder_).generic_string();
    if (gone || !proto::is_utf8(path)) continue;  // others cannot stand in an answer
    if (is_packed)
      files.packed.insert(path);
    else if (is_raster)
      found[path] = print;
    else if (print.bytes > 0 && ::access(entry->path().c_str(), R_OK) == 0)
      files.sides.add(path, print);
  }
  if (found.size() == kMostFiles) files.trouble = "only " + std::to_string(kMostFiles) + " of its rasters are datasets";
  if (error) files.trouble = "it cannot be read to its end: " + error.message();
  for (auto at = found.begin(); at != found.end();) {
    const auto sides = files.sides.of(at->first);
    const std::string header = raster::header_of(raster::extension_of(at->first));
    const bool lacks_some = !header.empty() && std::ranges::none_of(sides, [&](const SideFiles::Side& side) {
      return raster::extension_of(side.path) == header;
    });
    for (const auto& side : sides)
      if (at->second.bytes > 0) at->second.add(side.print);
    at = lacks_some ? found.erase(at) : std::next(at);
  }
  return files;
}

void LiveFolder::look() {
  Files found = files();
  const Prints& now = found.prints;
  std::error_code error;
  // A disk that is not mounted is no reason to delete anything.
  const bool away = !known_.empty() && (!fs::is_directory(folder_, error) || fs::is_empty(folder_, error));
  if (away) found.trouble = "it is empty or not there";
  if (found.trouble.empty())
    remove_gone(found);
  else
    warn("", folder_.string() + ": " + found.trouble + "; nothing is deleted");
  if (found.trouble.empty()) told_.erase("");
  std::erase_if(told_, [&](const auto& told) {
    const std::string& path = told.first;
    return !path.empty() && !now.contains(path) && !found.packed.contains(path) &&
           std::ranges::find(found.closed, path) == found.closed.end();
  });
  sides_ = std::move(found.sides);
  for (const std::string& closed : found.closed) warn(closed, closed + " may not be read by this service; it is passed over");
  for (const std::string& packed : found.packed)
    warn(packed, packed + " is passed over; what is in it is offered when it is unpacked");
  for (const auto& [path, print] : now) {
    if (stops()) return;
    const auto before = seen_.find(path);
    if (before == seen_.end() || before->second != print) continue;
    try {
      take(path, print);
    } catch (const std::exception& failed) {  // the registry's, or want of memory: the others have their turn
      warn(path, path + ": " + failed.what() + "; tried again");
    }
  }
  seen_ = now;
}

void LiveFolder::warn(const std::string& path, const std::string& what) {
  if (std::exchange(told_[path], what) != what) log_warning("live folder: " + what);
}

void LiveFolder::remove_gone(const Files& now) {
  std::vector<std::string> gone;
  for (const auto& [path, known] : known_) {
    const auto holds = [&path = path](const std::string& folder) { return path.starts_with(folder); };
    if (now.prints.contains(path) || std::ranges::any_of(now.closed, holds))
      missed_.erase(path);
    else if (++missed_[path] >= kMissedLooks)
      gone.push_back(path);
  }
  for (const std::string& path : gone) {
    const std::string id = known_[path].dataset;
    if (!id.empty() && service_.registry().find(id)) {
      if (!delete_dataset(service_, id)) continue;
      log_info("live folder: " + path + " is gone, and dataset " + id);
    }
    known_.erase(path);
    missed_.erase(path);
    write_notes();
  }
}

void LiveFolder::take(const std::string& path, const Print& print) {
  const auto found = known_.find(path);
  if (found != known_.end() && found->second.print == print) return;
  if (::access((folder_ / path).c_str(), R_OK) != 0) return warn(path, path + " may not be read by this service; tried again");
  const Row dataset =
      found != known_.end() && !found->second.dataset.empty() ? service_.registry().find(found->second.dataset) : nullptr;
  const bool is_change = dataset && dataset->state != State::failed;
  auto problem = refused(print, dataset ? limits::Entry::again : limits::Entry::fresh);
  if (!problem) problem = is_change ? change(path, print, *dataset) : begin(path, print);
  if (!problem) {
    told_.erase(path);
    return write_notes();
  }
  if (is_passing(*problem)) return warn(path, path + ": " + problem->line() + "; tried again");
  warn(path, path + ": " + problem->line());
  known_[path].print = print;  // not asked again before it changes
  write_notes();
}

std::optional<Problem> LiveFolder::refused(const Print& print, limits::Entry entry) {
  if (print.bytes == 0) return Problem{"body-empty", "the file is empty", "a raster", ""};
  const std::uint64_t most = most_bytes(service_.settings().serve.limits);
  if (print.bytes > most)
    return Problem{"body-too-large", "it has " + std::to_string(print.bytes) + " bytes, more than this service takes",
                   "at most " + std::to_string(most >> 20) + " MiB (body-limit)", ""};
  const auto place = service_.admission().enter(kWho, print.bytes, entry);
  return place ? std::nullopt : std::optional(place.problem());
}

std::optional<Problem> LiveFolder::begin(const std::string& path, const Print& print) {
  const auto found = known_.find(path);
  std::string id = found == known_.end() ? "" : found->second.dataset;
  if (!id.empty() && service_.registry().find(id) && !delete_dataset(service_, id))
    return Problem{"storage-full", "what failed before cannot be removed", "", ""};
  if (id.empty()) id = new_id(path);
  known_[path] = {id, {}, ""};
  write_notes();  // first: whatever happens, the file has this dataset and no second one
  const Upload room(service_.layout(), "");
  const auto file = with_sides(path, room);
  if (!file) return file.problem();
  Request request = sending(*file, "POST", "/v1/datasets");
  request.query = {{"name", fs::path(path).filename().string()}, {"updates", "1"}};
  if (auto refused = refusal(post_dataset(service_, request, id))) return refused;
  known_[path] = {id, print, first_source(service_.ledger().read(id))};
  log_info("live folder: " + path + " is dataset " + id);
  return std::nullopt;
}

std::optional<Problem> LiveFolder::change(const std::string& path, const Print& print, const Dataset& dataset) {
  const std::string source = own_source(service_.ledger().expected(dataset.id), path, known_[path].source);
  if (source.empty())
    return Problem{"source-unknown", "none of the rasters of dataset " + dataset.id + " is known to have come of this file", "",
                   ""};
  const Upload room(service_.layout(), "");
  const auto file = with_sides(path, room);
  if (!file) return file.problem();
  const Request request = sending(*file, "PUT", "/v1/datasets/" + dataset.id + "/sources/" + source);
  if (auto refused = refusal(updates::sources(service_, request, dataset, parse_route(request.path)))) return refused;
  known_[path].print = print;
  known_[path].source = source;
  log_info("live folder: " + path + " has changed, a new version of dataset " + dataset.id +
           ", with the levels and options of the first one");
  return std::nullopt;
}

proto::Result<fs::path> LiveFolder::with_sides(const std::string& path, const Upload& room) {
  const auto sides = sides_.of(path);
  std::error_code error;
  std::uintmax_t bytes = fs::file_size(folder_ / path, error);
  for (const auto& side : sides) bytes += side.print.bytes;
  if (bytes >= UINT32_MAX && !sides.empty())
    log_warning("live folder: " + path +
                " is read without what lies beside it: together they have more than the 4 GiB of a .zip");
  if (sides.empty() || bytes >= UINT32_MAX) return folder_ / path;
  std::vector<std::string> all;  // what is small first: if it cannot be read, that is known at once
  for (const auto& side : sides) all.push_back(side.path);
  all.push_back(path);
  std::vector<MoreRaster> files;
  for (const std::string& one : all) {
    MoreRaster& to =
        files.emplace_back(MoreRaster{fs::path(one).filename().string(), "part" + std::to_string(files.size()), "", 0});
    std::ofstream copy(room.folder() / to.file, std::ios::binary);
    const bool whole = read_pieces(folder_ / one, [&](std::string_view piece) {
      to.bytes += piece.size();
      return !stops() && bool(copy.write(piece.data(), static_cast<std::streamsize>(piece.size())));
    });
    if (stops()) return Problem{"service-stopping", "the service ends", "", ""};
    if (!whole || !copy.flush()) return Problem{"storage-full", one + " cannot be copied: " + std::strerror(errno), "", ""};
  }
  auto packed = with_sides_packed(room.folder(), files);
  if (!packed) return packed.problem();
  return room.folder() / packed->front().file;
}

std::string LiveFolder::new_id(const std::string& path) const {
  std::string flat = path;
  std::replace(flat.begin(), flat.end(), '/', '-');
  const std::string stem = id_stem(flat).empty() ? "raster" : id_stem(flat);
  std::string id = stem;
  const auto is_taken = [&] {  // by a dataset, or promised to a file that is still to become one
    return service_.find(id) != nullptr ||
           std::ranges::any_of(known_, [&](const auto& known) { return known.second.dataset == id; });
  };
  for (int k = 2; is_taken(); ++k) id = stem + "-" + std::to_string(k);
  return id;
}

void LiveFolder::write_notes() {
  std::error_code error;
  if (!fs::is_directory(service_.layout().root, error)) return log_warning("live folder: the data folder is away");
  const auto written = write_live_notes(service_.layout().live(), notes_);
  if (!written.ok()) log_warning("live folder: " + written.problem().line());
}

}  // namespace cordillera::server
