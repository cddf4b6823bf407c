#pragma once
// The manifest as clients read it.
#include <string>

#include "cordillera.pb.h"
#include "proto/result.h"

namespace cordillera::pipeline {

/// Field names as in the schema, defaults printed, indented. Errors of provisional tiles are null. What nobody has measured of
/// each of several rasters is left out, and so is their size where they have several.
std::string manifest_json(const proto::Manifest& manifest);
/// The raster, or all of them, have the size that the manifest's source tells.
bool has_one_size(const proto::Manifest& manifest);
/// Unknown members are passed over: a newer program may have written it.
proto::Result<proto::Manifest> parse_manifest_json(const std::string& json);
/// The manifest.json of a folder of tiles; a problem too where there is none.
proto::Result<proto::Manifest> manifest_of_folder(const std::string& folder);

/// Any message on one line with the schema's field names, defaults left out; empty when a string in it is not UTF-8.
std::string compact_json(const google::protobuf::Message& message);
/// False if the text is not such a message. Unknown members are passed over.
bool parse_json(const std::string& json, google::protobuf::Message* message);

}  // namespace cordillera::pipeline
