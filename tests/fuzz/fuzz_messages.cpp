// What comes from a disk that somebody else may have written: manifests, plans, what blocks left, tiles. The first byte chooses.
#include <cstddef>
#include <cstdint>
#include <string>

#include "pipeline/build/exact/kept_block.h"
#include "pipeline/encode/decode.h"
#include "pipeline/tileset/manifest_json.h"

using namespace cordillera;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data + 1), size - 1);
  proto::Plan plan;
  proto::Manifest manifest;
  switch (data[0] % 6) {
    case 0: (void)pipeline::parse_manifest_json(bytes); break;
    case 1: (void)pipeline::kept_block_from(bytes, 1024, 0.25F); break;
    case 2: (void)pipeline::decode_drc(bytes); break;
    case 3: (void)pipeline::decode_glb(bytes); break;
    case 4: (void)plan.ParseFromString(bytes); break;
    default:
      if (manifest.ParseFromString(bytes)) (void)pipeline::parse_manifest_json(pipeline::manifest_json(manifest));
  }
  return 0;
}
