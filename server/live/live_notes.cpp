#include "server/live/live_notes.h"

#include <cstdint>
#include <optional>
#include <utility>

#include "raster/storage/storage.h"
#include "server/http/json.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr const char* kFolder = "folder";  // no raster: it has no extension

std::optional<LiveNote> live_note(const Json& json) {
  const auto is = [&](const char* name, bool (Json::*kind)() const noexcept) {
    const auto found = json.find(name);
    return found != json.end() && ((*found).*kind)();
  };
  if (!json.is_object() || !is("dataset", &Json::is_string) || !is("bytes", &Json::is_number_unsigned) ||
      !is("changed_ns", &Json::is_number_integer) || (json.contains("source") && !is("source", &Json::is_string)))
    return std::nullopt;
  return LiveNote{json.value("dataset", ""),
                  {json.value("bytes", std::uint64_t{0}), json.value("changed_ns", std::int64_t{0})},
                  json.value("source", "")};
}

/// None: it is no such list.
std::optional<LiveNotes> notes_of(const Json& json) {
  if (!json.is_object()) return std::nullopt;
  LiveNotes notes;
  for (const auto& [path, one] : json.items()) {
    if (path == kFolder && one.is_string()) {
      notes.folder = one.get<std::string>();
      continue;
    }
    auto note = live_note(one);
    if (!note) return std::nullopt;
    notes.by_path.emplace(path, std::move(*note));
  }
  return notes;
}

Problem unusable_notes(const fs::path& file, const std::string& why) {
  return {"data-unusable", file.string() + " " + why,
          "the file of a backup; or starting without it: then the datasets stay, and each raster of the live folder becomes a "
          "new one",
          "--live"};
}

}  // namespace

proto::Result<LiveNotes> read_live_notes(const fs::path& file, const fs::path& folder) {
  const auto text = raster::read_whole(file.string());
  if (!text.ok()) return unusable_notes(file, "cannot be read: " + text.problem().detail);
  std::error_code error;
  const fs::path canonical = fs::canonical(folder, error);
  const std::string real = (error ? fs::absolute(folder) : canonical).string();
  if (!*text) return LiveNotes{real, {}};
  auto notes = notes_of(Json::parse(**text, nullptr, false));
  if (!notes) return unusable_notes(file, "is no list of which datasets came of which files");
  if (!notes->folder.empty() && notes->folder != real)
    return Problem{"options-conflict", file.string() + " tells of the rasters in " + notes->folder + ", and not in " + real,
                   "--live " + notes->folder + "; another data folder; or, if these rasters lie in " + real +
                       " now, that path as \"folder\" in the file",
                   "--live"};
  notes->folder = real;
  return std::move(*notes);
}

proto::Result<void> write_live_notes(const fs::path& file, const LiveNotes& notes) {
  Json json = Json::object();
  json[kFolder] = notes.folder;
  for (const auto& [path, note] : notes.by_path)
    json[path] = {
        {"dataset", note.dataset}, {"bytes", note.print.bytes}, {"changed_ns", note.print.changed_ns}, {"source", note.source}};
  return raster::write_whole(file.string(), json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace cordillera::server
