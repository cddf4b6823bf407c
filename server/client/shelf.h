#pragma once
// A folder that fetched files go into: each appears whole under its name, and the tag that it came with is remembered, so that
// what has not changed need not come again.
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "proto/result.h"
#include "raster/disk/descriptor.h"

namespace cordillera::server::client {

class Shelf {
 public:
  /// Several processes may fetch into one folder.
  static proto::Result<std::unique_ptr<Shelf>> open(const std::filesystem::path& folder);
  ~Shelf();
  Shelf(const Shelf&) = delete;
  Shelf& operator=(const Shelf&) = delete;

  /// The entity tag of the file as it stands there, if it came from this address and nobody has written to it since; else empty.
  std::string tag(const std::string& name, const std::string& from) const;

  /// A file on its way. Goes away with this object unless it was put.
  class Part {
   public:
    explicit Part(Shelf& shelf);
    ~Part();
    Part(const Part&) = delete;
    Part& operator=(const Part&) = delete;
    bool write(std::string_view bytes);
    /// Under its name, in one step. tag: of the answer; may be empty.
    proto::Result<void> put(const std::string& name, const std::string& from, const std::string& tag);

   private:
    Shelf& shelf_;
    std::filesystem::path path_;
    raster::Descriptor file_;
  };

 private:
  struct Known {
    std::string from, tag, state;
  };
  Shelf(std::filesystem::path folder, raster::Descriptor notes) : folder_(std::move(folder)), notes_(std::move(notes)) {}
  std::filesystem::path own() const { return folder_ / ".cordillera-fetch"; }
  void read();
  void note(const std::string& name, const Known& known);

  const std::filesystem::path folder_;
  const raster::Descriptor notes_;  ///< a line for each file that came, the last one counts
  mutable std::mutex mutex_;
  std::map<std::string, Known> known_;
  std::size_t lines_ = 0;
  unsigned parts_ = 0;
};

}  // namespace cordillera::server::client
