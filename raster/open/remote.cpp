#include "raster/open/remote.h"

#include <cpl_vsi.h>

#include <fstream>
#include <memory>

#include "proto/letters.h"
#include "raster/disk/free_space.h"
#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/storage/storage.h"

namespace cordillera::raster {
namespace {

constexpr std::string_view kStatus = "HTTP response code", kCurl = "CURL error: ", kNoRanges = "Range downloading not supported";

/// "503" of what GDAL says of an answer; "0": there was none. Empty: it says something else.
std::string status_in(const std::string& said) {
  const auto colon = said.rfind(": ");
  return said.starts_with(kStatus) && colon != said.npos ? said.substr(colon + 2) : "";
}

/// GDAL's words for people.
std::string answer_in(const std::string& said) {
  const std::string status = status_in(said);
  if (status == "0") return "its server does not answer";
  if (!status.empty()) return "its server answers " + status;
  return said.starts_with(kCurl) ? said.substr(kCurl.size()) : said;
}

/// GDAL says of an attempt that failed for the network's sake.
bool is_of_network(const std::string& said) { return said.starts_with(kStatus) || said.starts_with(kCurl); }

proto::Problem not_given(const std::string& name, const std::string& said) {
  return {"storage-read", name + " cannot be read: " + answer_in(said), "a file that can be read; or trying again later", ""};
}

void forget(const std::string& path) {
  // What lies in an archive there is remembered under the archive's name.
  if (path.find("/vsi", 1) == path.npos)
    ask_anew(path);
  else
    VSICurlClearCache();
}

std::string without_query(const std::string& path) { return path.substr(0, path.find('?')); }

}  // namespace

std::optional<proto::Problem> why_not_fetched(const std::string& path, const std::string& name, const std::string& heard) {
  const GdalScope scope(Trust::operator_file);
  forget(path);
  VSIStatBufL found{};
  // Without its size GDAL might not ask for it, and would say nothing.
  const bool there = VSIStatExL(path.c_str(), &found,
                                VSI_STAT_EXISTS_FLAG | VSI_STAT_NATURE_FLAG | VSI_STAT_SIZE_FLAG | VSI_STAT_SET_ERROR_FLAG) == 0;
  if (there && heard.find(kNoRanges) != heard.npos)
    return proto::Problem{"storage-read", name + " cannot be read: its server gives whole files only",
                          "a server that gives parts of files (range requests); or the file, fetched before", ""};
  if (there) return std::nullopt;
  const std::string said = scope.message(path, name);
  // Of a connection that fails only what opened the file says why.
  if ((said.empty() || status_in(said) == "0") && is_of_network(heard) && status_in(heard) != "404")
    return not_given(name, heard);
  if (!said.empty()) return not_given(name, said);
  return proto::Problem{"raster-not-found", name + " is not there", "", ""};
}

std::optional<proto::Problem> told_of_network(const std::string& name, const std::string& heard) {
  if (!is_of_network(heard)) return std::nullopt;
  if (status_in(heard) == "404") return proto::Problem{"raster-not-found", name + " names a raster that is not there", "", ""};
  return not_given(name, heard);
}

bool is_remote_archive(const std::string& path) {
  const std::string extension = extension_of(without_query(path));
  return is_remote(path) && path.find("/vsi", 1) == path.npos && (extension == ".zip" || extension == ".gz") &&
         !path.starts_with("/vsizip/") && !path.starts_with("/vsigzip/");
}

proto::Result<std::string> fetched(const std::string& path, const std::string& name, const PrivateFolder& folder) {
  const GdalScope scope(Trust::operator_file);
  const auto bytes = size_of(path);
  const std::string to = folder.place("fetched");
  if (!bytes) {
    if (auto why = why_not_fetched(path, name, "")) return *why;
    return proto::Problem{"raster-not-found", name + " is not a file", "", ""};
  }
  if (auto full = no_room(to, *bytes, name)) return *full;
  const std::unique_ptr<VSILFILE, int (*)(VSILFILE*)> from(VSIFOpenL(path.c_str(), "rb"), VSIFCloseL);
  std::ofstream out(to, std::ios::binary);
  std::string piece(std::size_t{8} << 20, '\0');
  for (std::uint64_t come = 0; come < *bytes;) {
    const std::size_t count =
        from ? VSIFReadL(piece.data(), 1, std::min<std::uint64_t>(piece.size(), *bytes - come), from.get()) : 0;
    if (count == 0) {
      const std::string heard = scope.message(path, name);
      if (auto why = why_not_fetched(path, name, heard)) return *why;
      return not_given(name, heard.empty() ? "it ended early" : heard);
    }
    if (!out.write(piece.data(), static_cast<std::streamsize>(count)))
      return proto::Problem{"storage-full", "there is no room in the temporary folder for " + name, "a disk with free space", ""};
    come += count;
  }
  if (out.flush()) return to;
  return proto::Problem{"storage-full", "there is no room in the temporary folder for " + name, "a disk with free space", ""};
}

}  // namespace cordillera::raster
