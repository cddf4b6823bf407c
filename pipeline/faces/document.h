#pragma once
// What a client gets.
#include <string>

namespace cordillera::pipeline::faces {

struct Document {
  std::string bytes;
  std::string etag;  ///< hex, without quotes; a function of the bytes
};

/// The tag is a hash of the bytes.
Document document(std::string bytes);

}  // namespace cordillera::pipeline::faces
