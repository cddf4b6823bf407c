// A raster in memory through open_source and a little of sample(). VRTs are left out: only the command line takes them, from the
// operator.
#include <cpl_vsi.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "cordillera.pb.h"
#include "proto/mesh.h"
#include "raster/source.h"

using namespace cordillera;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (text.find("<VRT") != text.npos || size > (1 << 20)) return 0;
  std::string bytes(text);
  const char* path = "/vsimem/fuzz/dem.tif";
  VSIFCloseL(VSIFileFromMemBuffer(path, reinterpret_cast<GByte*>(bytes.data()), bytes.size(), FALSE));
  proto::BuildOptions options;
  options.set_vertical_datum("ellipsoid");
  {
    const auto source = raster::open_source(path, "dem.tif", raster::Trust::operator_file, options);
    if (source) {
      // What is said of it goes into a manifest, and must come out again.
      if (!proto::Source().ParseFromString((*source)->description().SerializeAsString())) __builtin_trap();
      const proto::Lattice lattice{5};
      const auto w = (*source)->window(lattice);
      const auto columns = std::min<std::int64_t>(w.east - w.west + 1, 40),
                 rows = std::min<std::int64_t>(w.north - w.south + 1, 40);
      if (columns > 0 && rows > 0) {
        const auto samples =
            (*source)->sample(lattice, w.west, w.south, static_cast<std::int32_t>(columns), static_cast<std::int32_t>(rows));
        if (samples && samples->height.size() != static_cast<std::size_t>(columns * rows)) __builtin_trap();
      }
    } else if (source.problem().type.empty() || source.problem().detail.empty()) {
      __builtin_trap();
    }
  }
  VSIUnlink(path);
  return 0;
}
