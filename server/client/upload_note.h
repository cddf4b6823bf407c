#pragma once
// What a client that was killed leaves to the next one: where its upload is. A small file in the user's state folder, for one
// raster and one service; whoever has it open has it alone.
#include <memory>
#include <string>

#include "proto/result.h"
#include "raster/disk/descriptor.h"

namespace cordillera::server::client {

class UploadNote {
 public:
  /// purpose: what the upload is for, the service's address included; two purposes have two notes. identity: of the raster.
  /// A problem: another process sends this raster now. Without a place for notes there is one that forgets.
  static proto::Result<std::unique_ptr<UploadNote>> open(const std::string& purpose, const std::string& identity);
  ~UploadNote();
  UploadNote(const UploadNote&) = delete;
  UploadNote& operator=(const UploadNote&) = delete;

  /// The upload of these very bytes that is under way; empty: none.
  const std::string& upload() const { return upload_; }
  /// The upload of bytes that the file no longer has; empty: none.
  const std::string& outdated() const { return outdated_; }
  void keep(const std::string& upload);
  /// The work is done: the file goes.
  void remove();

 private:
  UploadNote(std::string path, raster::Descriptor file, std::string identity)
      : path_(std::move(path)), file_(std::move(file)), identity_(std::move(identity)) {}
  void read();

  std::string path_;
  raster::Descriptor file_;
  std::string identity_, upload_, outdated_;
};

}  // namespace cordillera::server::client
