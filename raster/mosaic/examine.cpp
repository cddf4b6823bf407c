// Where a raster lies and what it is, before it becomes a member of a mosaic.
#include "raster/mosaic/all_void.h"
#include "raster/mosaic/mosaic.h"
#include "raster/mosaic/same_grid.h"
#include "raster/open/raster_state.h"
#include "raster/place/area.h"
#include "raster/source/options.h"
#include "raster/source/raster_source.h"

namespace cordillera::raster {
namespace {

MosaicMember member_of(const std::string& path, const std::string& name, Trust trust, const proto::BuildOptions& options,
                       const Source& source) {
  return {path,
          name,
          trust,
          options,
          source.description(),
          source.window(kMemberLattice),
          state_of_raster(path, trust),
          source.datum_print(),
          grid_of(dynamic_cast<const RasterSource&>(source))};  // which open_source gives
}

}  // namespace

proto::Result<MosaicMember> examine(const std::string& path, const std::string& name, Trust trust,
                                    const proto::BuildOptions& options) {
  const auto source = open_source(path, name, trust, options);
  return source.ok() ? member_of(path, name, trust, options, **source) : proto::Result<MosaicMember>(source.problem());
}

bool lies_beside(const proto::Problem& problem) { return problem.type == "bbox-outside-raster"; }

proto::Problem beside_all(const std::vector<MosaicMember>& asked) {
  constexpr std::size_t kMostOpened = 64;  // one in a storage takes a second
  const std::size_t step = (asked.size() + kMostOpened - 1) / kMostOpened;
  std::vector<MosaicMember> some;
  for (std::size_t k = 0; k < asked.size(); k += step) {
    proto::BuildOptions options = asked[k].options;
    options.clear_bbox();
    if (auto member = examine(asked[k].path, asked[k].name, asked[k].trust, options)) some.push_back(std::move(*member));
  }
  const auto data = some.empty() ? std::nullopt : area_of(make_mosaic(some, 0)->description().bbox());
  const auto options = check_options(asked.front().options);
  const std::string hint = data && options.ok() && options->bbox ? hint_on_order(*options->bbox, *data) : "";
  const std::string where = step == 1 ? ", which lie in " : ", some of which lie in ";
  return {"bbox-outside-raster", "the bbox touches none of the " + std::to_string(asked.size()) + " rasters" + hint,
          "a bbox over the data" + (data ? where + text_of(*data) : ""), "bbox"};
}

proto::Result<MosaicMember> examine_pixels(const std::string& path, const std::string& name, Trust trust,
                                           const proto::BuildOptions& options) {
  const auto source = open_source(path, name, trust, options);
  if (!source.ok()) return source.problem();
  MosaicMember member = member_of(path, name, trust, options, **source);
  if (is_all_void(dynamic_cast<RasterSource&>(**source))) member.description.set_all_void(true);
  return member;
}

}  // namespace cordillera::raster
