#include "server/datasets/upload.h"

#include <string.h>
#include <sys/xattr.h>

#include "proto/letters.h"
#include "proto/numbers.h"
#include "raster/disk/new_file.h"
#include "raster/disk/write_all.h"
#include "server/http/digest.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSentNote = "user.cordillera.sent";

proto::Problem too_large(std::uint64_t limit) {
  return {"body-too-large", "the body is larger than this service takes", "at most " + std::to_string(limit >> 20) + " MiB", ""};
}

proto::Problem cannot_write() {
  return {"storage-full", "the raster cannot be written to disk: " + std::string(strerror(errno)), "", ""};
}

}  // namespace

Upload::Upload(const Layout& layout, const std::string& suffix)
    : folder_(layout.incoming() / random_letters(16)), raster_("source" + suffix) {
  std::error_code ignored;  // writing the file will fail and say so
  fs::create_directory(folder_, ignored);
}

Upload::~Upload() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

proto::Result<void> Upload::receive(const Request& request, std::uint64_t limit, std::optional<std::uint64_t> expected) {
  if (expected && *expected > limit) return too_large(limit);
  raster::NewFile file(folder_ / raster_);
  if (!file.is_open()) return cannot_write();
  Digest digest;
  std::uint64_t size = 0;
  bool written = true;
  const bool ended = request.read_body && request.read_body([&](std::string_view piece) {
    size += piece.size();
    if (size > limit) return false;
    digest.add(piece);
    written = file.write(piece);
    return written;
  });
  if (size > limit) return too_large(limit);
  if (!written) return cannot_write();
  if (!ended || (expected && *expected != size)) {
    return proto::Problem{"body-incomplete",
                          "the upload ended after " + std::to_string(size) + " bytes" +
                              (expected ? " of " + std::to_string(*expected) : std::string()) + "; nothing was kept",
                          "the whole raster", ""};
  }
  if (size == 0) {
    return proto::Problem{"body-empty", "the request has no body", "a raster as the body: curl --data-binary @dem.tif …", ""};
  }
  if (!file.close()) return cannot_write();
  if (request.sent) note_sent(folder_ / raster_, *request.sent);
  hash_ = digest.finish();
  return {};
}

proto::Result<void> Upload::adopt(const fs::path& file) {
  std::error_code error;
  fs::create_hard_link(file, folder_ / raster_, error);
  if (error) return proto::Problem{"storage-full", "the upload cannot be taken over: " + error.message(), "", ""};
  hash_ = digest_of_file(file);
  if (hash_.empty()) return cannot_write();
  return {};
}

proto::Result<void> Upload::rename(const std::string& suffix) {
  const std::string name = "source" + suffix;
  std::error_code error;
  fs::rename(folder_ / raster_, folder_ / name, error);
  if (error) return proto::Problem{"storage-full", "the raster cannot get its name: " + error.message(), "", ""};
  raster_ = name;
  return {};
}

proto::Result<void> Upload::move_to(const fs::path& place) {
  std::error_code error;
  const bool named = raster::sync_path(folder_);
  if (named) fs::rename(folder_, place, error);
  if (!named || error) {
    const std::string why = error ? error.message() : strerror(errno);
    return proto::Problem{"storage-full", "the raster cannot be put into its place: " + why, "", ""};
  }
  folder_ = place;  // goes away again unless the last step succeeds too
  if (!raster::sync_path(place.parent_path())) return cannot_write();
  folder_.clear();
  return {};
}

void note_sent(const fs::path& file, std::uint64_t bytes) {
  const std::string text = std::to_string(bytes);
  setxattr(file.c_str(), kSentNote, text.data(), text.size(), 0);
}

std::optional<std::uint64_t> sent_bytes(const fs::path& file) {
  char text[20];
  const auto size = getxattr(file.c_str(), kSentNote, text, sizeof text);
  return size > 0 ? proto::number<std::uint64_t>(std::string_view(text, static_cast<std::size_t>(size))) : std::nullopt;
}

std::string suffix_of(const std::string& name) {
  const auto dot = name.rfind('.');
  if (dot == std::string::npos || name.size() - dot - 1 > 8 || name.size() - dot == 1) return "";
  std::string suffix = ".";
  for (const char c : name.substr(dot + 1)) {
    if (!proto::is_letter_or_digit(c)) return "";
    suffix += proto::lower(c);
  }
  return suffix;
}

std::string id_stem(const std::string& file) {
  std::string id;
  for (const char c : file.substr(0, file.size() - suffix_of(file).size())) {
    if (proto::is_letter_or_digit(c)) {
      id += proto::lower(c);
    } else if (!id.empty() && id.back() != '-') {
      id += '-';
    }
    if (id.size() >= 40) break;
  }
  if (!id.empty() && id.back() == '-') id.pop_back();
  return id;
}

std::string make_id(const std::string& name) {
  const std::string stem = id_stem(name.substr(name.rfind('/') + 1));
  return (stem.empty() ? "" : stem + "-") + random_letters(8);
}

}  // namespace cordillera::server
