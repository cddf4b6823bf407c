#pragma once
// What may be compressed for whom. Text and JSON are compressed at the socket; here, documents of other types that clients expect
// so.
#include <string>
#include <string_view>

#include "pipeline/faces/terrain.h"
#include "server/http/message.h"

namespace cordillera::server {

/// Whether the request's Accept-Encoding allows gzip (RFC 9110, 12.5.3). Without the header it does not: what is asked without it
/// may be written to disk as it comes.
bool accepts_gzip(const Request& request);
/// The same for gzip or br.
bool accepts(const Request& request, std::string_view coding);

/// What a Content-Encoding means, in small letters. Empty: the bytes are as they are.
std::string coding_of(std::string_view content_encoding);

/// Media types that the socket compresses.
bool is_compressible(std::string_view type);

/// The document compressed, with a tag of its own; kept with the dataset.
pipeline::faces::Document gzipped(const pipeline::faces::Terrain& terrain, const pipeline::faces::Document& plain);

}  // namespace cordillera::server
