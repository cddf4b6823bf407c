#pragma once
// A request's body on its way to disk, never held in memory.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "proto/result.h"
#include "server/data/layout.h"
#include "server/http/message.h"

namespace cordillera::server {

/// A folder in data/incoming with the raster in it. Goes away with this object unless it was kept.
class Upload {
 public:
  /// suffix: of the raster's file name, with the dot, or empty.
  Upload(const Layout& layout, const std::string& suffix);
  ~Upload();
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  /// Writes the body down. expected: Content-Length of an unencoded body.
  proto::Result<void> receive(const Request& request, std::uint64_t limit, std::optional<std::uint64_t> expected);
  /// Takes a file that is on disk already, by a second name: the first one stays until its owner removes it.
  proto::Result<void> adopt(const std::filesystem::path& file);
  /// Gives the raster, once it is there, the suffix of its name; one that comes in a form is named behind its beginning.
  proto::Result<void> rename(const std::string& suffix);
  /// Another file of the folder in the raster's place; what was there is no longer looked for.
  void take(const std::string& file, const std::string& hash) { raster_ = file, hash_ = hash; }
  /// Moves the folder to its place, where it then is whatever happens to the machine.
  proto::Result<void> move_to(const std::filesystem::path& place);

  const std::filesystem::path& folder() const { return folder_; }
  const std::string& raster() const { return raster_; }  ///< file name in the folder
  const std::string& body_hash() const { return hash_; }

 private:
  std::filesystem::path folder_;
  std::string raster_;
  std::string hash_;
};

/// How few bytes a raster came in, noted with the file itself, whatever becomes of its name: it may be cheap to send and large.
/// Nothing where it came as it is, and where the disk keeps no such notes.
void note_sent(const std::filesystem::path& file, std::uint64_t bytes);
std::optional<std::uint64_t> sent_bytes(const std::filesystem::path& file);

/// ".tif" of "My dem.TIF"; empty if the name has no plain suffix.
std::string suffix_of(const std::string& name);
/// "my-dem" of "My DEM.tif", at most 40 letters, digits and dashes; empty if there are none.
std::string id_stem(const std::string& file);
/// A dataset id: the stem of a name that may have folders, and a random word.
std::string make_id(const std::string& name);

}  // namespace cordillera::server
