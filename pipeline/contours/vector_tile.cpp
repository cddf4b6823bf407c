#include "pipeline/contours/vector_tile.h"

#include <map>

#include "vector_tile.pb.h"

namespace cordillera::pipeline::contours {
namespace {

constexpr std::uint32_t kMoveTo = 1, kLineTo = 2, kLineString = 2;  // as the specification numbers them
constexpr std::uint32_t kVersion = 2;
constexpr std::uint32_t kEle = 0, kIndex = 1;  // of the keys

std::uint32_t command(std::uint32_t id, std::size_t count) { return static_cast<std::uint32_t>(count) << 3 | id; }

std::uint32_t zigzag(std::int32_t value) {
  return static_cast<std::uint32_t>(value) << 1 ^ static_cast<std::uint32_t>(value >> 31);
}

/// Steps go on from the last point of the line before.
void add_lines(const std::vector<TileLine>& lines, proto::VectorTileFeature& feature) {
  TilePoint at;
  const auto step_to = [&](const TilePoint& point) {
    feature.add_geometry(zigzag(point.x - at.x));
    feature.add_geometry(zigzag(point.y - at.y));
    at = point;
  };
  for (const TileLine& line : lines) {
    feature.add_geometry(command(kMoveTo, 1));
    step_to(line.front());
    feature.add_geometry(command(kLineTo, line.size() - 1));
    for (std::size_t k = 1; k < line.size(); ++k) step_to(line[k]);
  }
}

/// Numbers of values, each of which stands in the layer once.
class Values {
 public:
  explicit Values(proto::VectorTileLayer& layer) : layer_(layer) {}
  std::uint32_t of(std::int64_t thousandths) {
    const auto [found, fresh] = known_.try_emplace(thousandths, static_cast<std::uint32_t>(layer_.values_size()));
    if (!fresh) return found->second;
    proto::VectorTileValue& value = *layer_.add_values();
    if (thousandths % 1000 == 0)
      value.set_sint_value(thousandths / 1000);
    else
      value.set_double_value(static_cast<double>(thousandths) / 1000);
    return found->second;
  }

 private:
  proto::VectorTileLayer& layer_;
  std::map<std::int64_t, std::uint32_t> known_;
};

}  // namespace

std::string vector_tile(const std::vector<Contour>& contours, Interval interval) {
  proto::VectorTile tile;
  proto::VectorTileLayer& layer = *tile.add_layers();
  layer.set_version(kVersion);
  layer.set_name(std::string(kLayer));
  layer.set_extent(kExtent);
  layer.add_keys("ele");
  layer.add_keys("index");
  Values values(layer);
  for (const Contour& contour : contours) {
    proto::VectorTileFeature& feature = *layer.add_features();
    feature.set_type(kLineString);
    for (const std::uint32_t tag : {kEle, values.of(contour.height_mm)}) feature.add_tags(tag);
    const int index = index_of(contour.height_mm / interval.mm);
    for (const std::uint32_t tag : {kIndex, values.of(1000 * std::int64_t{index})}) feature.add_tags(tag);
    add_lines(contour.lines, feature);
  }
  return tile.SerializeAsString();
}

}  // namespace cordillera::pipeline::contours
