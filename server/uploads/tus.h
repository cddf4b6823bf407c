#pragma once
// tus 1.0 (tus.io): core, creation and termination. What arrives becomes a dataset with POST /v1/datasets?upload=ID.
#include "server/http/message.h"
#include "server/uploads/part_files.h"

namespace cordillera::server::uploads {

struct Bounds {
  std::uint64_t most_bytes = 0;  ///< of an upload
  std::string sender;            ///< who asks, as far as uploads are counted
};

/// POST /v1/uploads.
Response begin(PartFiles& files, const Request& request, const Bounds& bounds);
/// HEAD, GET, PATCH, DELETE /v1/uploads/{id}.
Response at(PartFiles& files, const std::string& id, const Request& request);
/// What an OPTIONS request is told besides.
void announce(Response& response, const Bounds& bounds);

/// Slug upload-unknown.
proto::Problem unknown_upload(const std::string& id);
/// The upload, if it is this client's and all of it is there.
proto::Result<PartFile> finished(const PartFiles& files, const std::string& id, const Request& request);

}  // namespace cordillera::server::uploads
