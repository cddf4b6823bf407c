#include "server/uploads/part_files.h"

#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <memory>

#include "raster/disk/descriptor.h"
#include "raster/disk/new_file.h"
#include "raster/disk/write_all.h"
#include "server/http/digest.h"
#include "server/http/json.h"
#include "server/log/log.h"

namespace cordillera::server::uploads {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr const char* kDescription = "upload.json";
/// What a kill can cost of an upload. More often would be a sync more often.
constexpr std::uint64_t kNotedEvery = std::uint64_t{64} << 20;

Problem unknown(const std::string& id) {
  return {"upload-unknown", "there is no upload '" + id.substr(0, 80) + "'",
          "an upload that POST /v1/uploads began and no dataset was made of yet", ""};
}

Problem full(const std::string& why) {
  return {"storage-full", "the upload cannot be written to disk: " + why, "going on when there is room again", ""};
}

}  // namespace

proto::Result<PartFile> PartFiles::create(PartFile wanted) {
  std::error_code error;
  fs::create_directories(folder_, error);
  remove_old();
  if (const auto refused = too_many(wanted.sender)) return *refused;
  wanted.id = random_letters(24);
  wanted.offset = 0;
  const fs::path folder = folder_ / wanted.id;
  if (fs::create_directory(folder, error) && raster::NewFile(folder / "part").close() && write_down(wanted) &&
      raster::sync_path(folder_))
    return wanted;
  const std::string why = error ? error.message() : strerror(errno);
  fs::remove_all(folder, error);
  return full(why);
}

/// Of all, and of one sender: who begins uploads for fun must leave room for the others.
std::optional<Problem> PartFiles::too_many(const std::string& sender) const {
  std::size_t all = 0, own = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    ++all;
    const auto file = find(entry.path().filename().string());
    if (file && file->sender == sender) ++own;
  }
  if (all < kMostUnfinished && own < kMostOfOneSender) return std::nullopt;
  const std::string why = own >= kMostOfOneSender ? "you have begun " + std::to_string(own) + " uploads that are unfinished"
                                                  : std::to_string(all) + " uploads are unfinished";
  return Problem{
      "too-many-uploads", why,
      "finishing or deleting one of them; each goes away after " + std::to_string(kKeptDays) + " days without a new byte", ""};
}

bool PartFiles::write_down(const PartFile& file) const {
  const Json json = {
      {"length", file.length}, {"offset", file.offset}, {"name", file.name}, {"owner", file.owner}, {"sender", file.sender}};
  // Not with write_whole(), which makes the folder where it is not there: the upload may be deleted at this moment.
  const fs::path folder = folder_ / file.id, next = folder / "upload.json.new";
  std::error_code error;
  fs::remove(next, error);  // what a kill left
  raster::NewFile out(next);
  return out.is_open() && out.write(json.dump()) && out.close() && raster::put_in_place(next, folder / kDescription);
}

std::optional<PartFile> PartFiles::find(const std::string& id) const {
  std::ifstream in(folder_ / id / kDescription);
  const Json json = in ? Json::parse(in, nullptr, false) : Json();
  if (!json.is_object()) return std::nullopt;
  PartFile file{id,
                json.value("name", ""),
                json.value("owner", ""),
                json.value("sender", ""),
                json.value("length", std::uint64_t{0}),
                json.value("offset", std::uint64_t{0})};
  std::error_code error;
  const auto size = fs::file_size(bytes_of(id), error);
  if (!error && size >= file.offset) return file;
  log_warning("upload " + id + ": the " + std::to_string(file.offset) + " bytes that were promised are gone");
  return std::nullopt;
}

proto::Result<PartFile> PartFiles::append(const std::string& id, std::uint64_t offset, const Request& request) {
  {
    const std::lock_guard lock(mutex_);
    if (!in_use_.insert(id).second)
      return Problem{"upload-conflict", "another request is writing to this upload", "going on when that has ended", ""};
  }
  const std::shared_ptr<void> over(nullptr, [&](void*) {
    const std::lock_guard lock(mutex_);
    in_use_.erase(id);
  });
  auto file = find(id);
  if (!file) return unknown(id);
  if (offset != file->offset) {
    return Problem{"upload-conflict",
                   "the upload stands at " + std::to_string(file->offset) + ", not at " + std::to_string(offset),
                   "Upload-Offset: " + std::to_string(file->offset), "Upload-Offset"};
  }
  const raster::Descriptor part(::open(bytes_of(id).c_str(), O_WRONLY | O_CLOEXEC));
  // Bytes behind the offset were never acknowledged.
  if (!part.is_open() || ftruncate(part.number(), static_cast<off_t>(offset)) != 0 ||
      lseek(part.number(), static_cast<off_t>(offset), SEEK_SET) < 0) {
    return full(strerror(errno));
  }
  std::uint64_t at = offset;
  bool too_long = false, failed = false, whole = true;
  const auto note = [&] {
    if (fsync(part.number()) != 0) return false;
    PartFile noted = *file;
    noted.offset = at;
    if (!write_down(noted)) return false;
    file->offset = at;
    return true;
  };
  if (request.read_body) {
    whole = request.read_body([&](std::string_view piece) {
      too_long = at + piece.size() > file->length;
      if (too_long) return false;
      failed = !raster::write_all(part.number(), piece);
      if (failed) return false;
      at += piece.size();
      failed = at - file->offset >= kNotedEvery && !note();
      return !failed;
    });
  }
  const int why = errno;
  if (too_long)
    return Problem{"body-too-large", "more bytes came than Upload-Length announced",
                   "the " + std::to_string(file->length) + " bytes of it", ""};
  if (!failed && (at == file->offset || note())) {
    if (whole) return *file;
    return Problem{"body-incomplete", "the part broke off before its end; what came before is kept",
                   "going on at Upload-Offset: " + std::to_string(file->offset), ""};
  }
  // Somebody may have deleted it meanwhile; then nothing can be gone on with.
  std::error_code error;
  if (!fs::exists(folder_ / id / kDescription, error)) return unknown(id);
  return full(strerror(failed ? why : errno));
}

void PartFiles::remove(const std::string& id) {
  std::error_code error;
  // Without its description it is none: a kill in between leaves nothing that could be gone on with.
  fs::remove(folder_ / id / kDescription, error);
  fs::remove_all(folder_ / id, error);
}

void PartFiles::remove_old() {
  std::error_code error;
  const auto oldest = fs::file_time_type::clock::now() - std::chrono::hours(24 * kKeptDays);
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    const std::string id = entry.path().filename().string();
    const auto changed = fs::last_write_time(entry.path(), error);
    // One without a description is being made by another thread, or was cut off.
    const bool cut =
        !fs::exists(entry.path() / kDescription, error) && changed < fs::file_time_type::clock::now() - std::chrono::minutes(10);
    if (!cut && changed > oldest) continue;
    log_info("removing the upload " + id + ", which nobody went on with");
    remove(id);
  }
}

}  // namespace cordillera::server::uploads
