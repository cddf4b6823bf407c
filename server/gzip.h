#pragma once
// Documents that clients expect compressed and that the HTTP library, which compresses text and JSON by itself, would leave
// alone.
#include "pipeline/faces/terrain.h"
#include "server/message.h"

namespace cordillera::server {

/// Whether the request's Accept-Encoding allows gzip (RFC 9110, 12.5.3). Without the header it does not: what is asked without it
/// may be written to disk as it comes.
bool accepts_gzip(const Request& request);

/// The document compressed, with a tag of its own; kept with the dataset.
pipeline::faces::Document gzipped(const pipeline::faces::Terrain& terrain, const pipeline::faces::Document& plain);

}  // namespace cordillera::server
