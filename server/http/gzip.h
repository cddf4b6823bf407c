#pragma once
// What may be compressed for whom. Text and JSON are compressed at the socket; here, documents of other types that clients expect
// so.
#include <initializer_list>
#include <string>
#include <string_view>

#include "pipeline/faces/terrain.h"
#include "server/http/message.h"

namespace cordillera::server {

/// Which of these codings the request's Accept-Encoding prefers (RFC 9110, 12.5.3): the one of the greatest q, of equal ones the
/// first. Empty: the bytes as they are, which is what comes where all of these are refused. Without the header, too: what is
/// asked without it may be written to disk as it comes.
std::string_view preferred_coding(const Request& request, std::initializer_list<std::string_view> codings);
/// Whether gzip is preferred to the bytes as they are.
bool accepts_gzip(const Request& request);

/// What a Content-Encoding means, in small letters. Empty: the bytes are as they are.
std::string coding_of(std::string_view content_encoding);

/// Media types that the socket compresses.
bool is_compressible(std::string_view type);

/// The document compressed, with a tag of its own; kept with the dataset.
pipeline::faces::Document gzipped(const pipeline::faces::Terrain& terrain, const pipeline::faces::Document& plain);

}  // namespace cordillera::server
