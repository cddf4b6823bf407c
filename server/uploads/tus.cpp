#include "server/uploads/tus.h"

#include "proto/numbers.h"
#include "server/http/gzip.h"
#include "server/http/json.h"
#include "server/options/option_values.h"

namespace cordillera::server::uploads {
namespace {

using proto::Problem;

constexpr const char* kVersion = "1.0.0";

Response with_version(Response response) {
  response.set("Tus-Resumable", kVersion);
  return response;
}

Response refused(const Problem& problem) { return with_version(problem_response(problem)); }

std::optional<std::uint64_t> number(const std::optional<std::string>& text) {
  return text ? proto::number<std::uint64_t>(*text) : std::nullopt;
}

/// A client that says nothing is taken to mean this version: curl is enough for an upload.
std::optional<Problem> other_version(const Request& request) {
  const std::string version = request.header("tus-resumable").value_or(kVersion);
  if (version == kVersion) return std::nullopt;
  return Problem{"tus-version", "the client speaks tus " + version.substr(0, 20), "Tus-Resumable: 1.0.0", "Tus-Resumable"};
}

/// None if it is no base64.
std::optional<std::string> from_base64(std::string_view text) {
  static constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  std::string out;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const auto digit = kDigits.find(c);
    if (digit == kDigits.npos) return std::nullopt;
    bits = (bits << 6 | static_cast<std::uint32_t>(digit)) & 0xffffff;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    out += static_cast<char>(bits >> count & 0xff);
  }
  return out;
}

/// "filename d29ybGQ=,other b3RoZXI=": the file's name, if there is one.
proto::Result<std::string> name_in(const std::string& metadata) {
  std::string_view rest = metadata;
  while (!rest.empty()) {
    std::string_view pair = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    while (!pair.empty() && pair.front() == ' ') pair.remove_prefix(1);
    const auto blank = pair.find(' ');
    const std::string_view key = pair.substr(0, blank);
    if (key != "filename" && key != "name") continue;
    const auto value = blank == pair.npos ? std::optional<std::string>("") : from_base64(pair.substr(blank + 1));
    std::string name;
    if (value && value->size() <= 255 && !read_text(*value, &name)) return name;
    return Problem{"upload-invalid", "Upload-Metadata has a name that is no text in base64",
                   "filename and its base64, at most 255 bytes without control characters", "Upload-Metadata"};
  }
  return std::string();
}

Response offset_response(int status, const PartFile& file) {
  Response response;
  response.status = status;
  response.set("Upload-Offset", std::to_string(file.offset));
  response.set("Cache-Control", "no-store");
  return with_version(std::move(response));
}

Response state(const PartFile& file) {
  Response response =
      json_response(200, {{"id", file.id}, {"name", file.name}, {"offset", file.offset}, {"length", file.length}});
  response.set("Upload-Offset", std::to_string(file.offset));
  response.set("Upload-Length", std::to_string(file.length));
  response.set("Cache-Control", "no-store");
  return with_version(std::move(response));
}

/// Upload-Offset counts the raster's own bytes, and a part goes on wherever it broke off: of a compressed one no client could
/// tell where that is.
bool is_coded(const Request& request) { return !coding_of(request.header("content-encoding").value_or("")).empty(); }

Response patch(PartFiles& files, const std::string& id, const Request& request) {
  if (request.header("content-type").value_or("") != "application/offset+octet-stream") {
    return refused({"upload-type", "a part of an upload has a type of its own", "Content-Type: application/offset+octet-stream",
                    "Content-Type"});
  }
  if (is_coded(request)) {
    Response response = refused({"coding-unknown", "a part of an upload is taken as it is, and this one is compressed",
                                 "no Content-Encoding, or identity", "Content-Encoding"});
    response.set("Accept-Encoding", "identity");
    return response;
  }
  const auto offset = number(request.header("upload-offset"));
  if (!offset)
    return refused({"upload-invalid", "Upload-Offset is missing or no number", "the offset that a HEAD of the upload tells",
                    "Upload-Offset"});
  const auto file = files.append(id, *offset, request);
  return file ? offset_response(204, *file) : refused(file.problem());
}

}  // namespace

Problem unknown_upload(const std::string& id) {
  return {"upload-unknown", "there is no upload '" + id.substr(0, 80) + "'",
          "an upload that POST /v1/uploads began and no dataset was made of yet", "upload"};
}

void announce(Response& response, const Bounds& bounds) {
  response.set("Tus-Resumable", kVersion);
  response.set("Tus-Version", kVersion);
  response.set("Tus-Extension", "creation,termination");
  response.set("Tus-Max-Size", std::to_string(bounds.most_bytes));
}

Response begin(PartFiles& files, const Request& request, const Bounds& bounds) {
  if (const auto other = other_version(request)) {
    Response response = refused(*other);
    response.set("Tus-Version", kVersion);
    return response;
  }
  const auto length = number(request.header("upload-length"));
  if (!length || *length == 0) {
    return refused({"upload-invalid", "Upload-Length is missing or no number above 0", "the number of bytes of the raster",
                    "Upload-Length"});
  }
  if (*length > bounds.most_bytes) {
    return refused({"body-too-large", "the upload would have " + std::to_string(*length) + " bytes, more than this service takes",
                    "at most " + std::to_string(bounds.most_bytes >> 20) + " MiB", "Upload-Length"});
  }
  auto name = name_in(request.header("upload-metadata").value_or(""));
  if (!name) return refused(name.problem());
  const auto file = files.create({"", *name, request.who.name, bounds.sender, *length, 0});
  if (!file) return refused(file.problem());
  Response response = offset_response(201, *file);
  response.set("Location", "uploads/" + file->id);
  return response;
}

Response at(PartFiles& files, const std::string& id, const Request& request) {
  if (const auto other = other_version(request)) return refused(*other);
  const auto file = files.find(id);
  const bool removes_any = request.method == "DELETE" && request.who.role >= access::Role::admin;
  if (!file || (file->owner != request.who.name && !removes_any)) return refused(unknown_upload(id));
  if (request.method == "PATCH") return patch(files, id, request);
  if (request.method != "DELETE") return state(*file);
  files.remove(id);
  Response response;
  response.status = 204;
  return with_version(std::move(response));
}

proto::Result<PartFile> finished(const PartFiles& files, const std::string& id, const Request& request) {
  const auto file = files.find(id);
  if (!file || file->owner != request.who.name) return unknown_upload(id);
  if (file->offset == file->length) return *file;
  return Problem{"upload-conflict",
                 "the upload has " + std::to_string(file->offset) + " of its " + std::to_string(file->length) + " bytes",
                 "sending the rest first, with PATCH", "upload"};
}

}  // namespace cordillera::server::uploads
