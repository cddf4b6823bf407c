#include "pipeline/faces/document.h"

#include <utility>

#include "pipeline/store/content_hash.h"

namespace cordillera::pipeline::faces {

Document document(std::string bytes) {
  std::string etag = hex(content_hash(bytes));
  return {std::move(bytes), std::move(etag)};
}

}  // namespace cordillera::pipeline::faces
