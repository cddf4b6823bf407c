#pragma once
// A raster on its way to a service: in one request, or in parts that survive a broken connection and the end of this program.
#include <memory>
#include <string>
#include <vector>

#include "server/cli/progress_bar.h"
#include "server/client/local_file.h"
#include "server/client/talk.h"
#include "server/client/upload_note.h"

namespace cordillera::server::client {

/// Larger ones go in parts. A service that refuses an upload before its end reads on for so many bytes, so that the client hears
/// why.
inline constexpr std::uint64_t kLarge = std::uint64_t{64} << 20;
inline constexpr std::uint64_t kPart = std::uint64_t{32} << 20;

/// Where a raster goes, and what it is called there.
struct PostTarget {
  std::string path;   ///< "/v1/datasets"
  std::string query;  ///< "name=a.tif&error=5"
  std::string name;
};

enum class Way { whole, parts };

class Sender {
 public:
  Sender(Talk& talk, Verbosity words) : talk_(talk), bar_(ProgressBar::style_of(words == Verbosity::all)) {}

  /// What the service answers, an answer of 200, 201 or 202; else a problem.
  proto::Result<Json> send(LocalFile& file, const PostTarget& target, Way way);
  /// Everything that was sent is where it belongs: a next line sends it anew.
  void forget();

 private:
  proto::Result<Json> send_whole(LocalFile& file, const PostTarget& target);
  proto::Result<Json> send_parts(LocalFile& file, const PostTarget& target);
  proto::Result<void> begin(const LocalFile& file, const PostTarget& target, UploadNote& note);
  /// From the byte on that the upload stands at.
  proto::Result<void> send_rest(LocalFile& file, const UploadNote& note, std::uint64_t offset);
  Answer finish(const PostTarget& target, const std::string& upload);
  Call with_bytes(LocalFile& file, std::uint64_t from, std::uint64_t count);
  void show(std::uint64_t done, std::uint64_t total);

  Talk& talk_;
  ProgressBar bar_;
  std::vector<std::unique_ptr<UploadNote>> notes_;
  std::uint64_t first_ = 0;  ///< byte that this run began with
  std::chrono::steady_clock::time_point started_, shown_;
};

}  // namespace cordillera::server::client
