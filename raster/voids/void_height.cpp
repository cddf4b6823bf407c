#include "raster/voids/void_height.h"

#include <cmath>

#include "proto/mesh.h"
#include "proto/numbers.h"

namespace cordillera::raster {

proto::Result<std::optional<double>> void_height_m(const std::string& text) {
  if (text.empty() || text == "fill" || text == "hole") return std::optional<double>();
  const auto wrong = [](const std::string& why) { return proto::Problem{"option-invalid", why, "", "voids"}; };
  const auto height_m = proto::number<double>(std::string_view(text).substr(text.starts_with('+') ? 1 : 0));
  if (!height_m || std::isnan(*height_m) || text.starts_with("+-")) return wrong("not a number, and neither fill nor hole");
  if (*height_m > proto::kMaxHeight_m) return wrong("higher than any height may be");
  if (*height_m < kLeastVoidHeight_m)
    return wrong("pits deeper than any land; nodata=" + text + " says that this value means no data");
  return height_m;
}

}  // namespace cordillera::raster
