// Where a raster lies and what it is, before it becomes a member of a mosaic.
#include "raster/mosaic/all_void.h"
#include "raster/mosaic/mosaic.h"
#include "raster/mosaic/same_grid.h"
#include "raster/open/raster_state.h"
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

proto::Result<MosaicMember> examine_pixels(const std::string& path, const std::string& name, Trust trust,
                                           const proto::BuildOptions& options) {
  const auto source = open_source(path, name, trust, options);
  if (!source.ok()) return source.problem();
  MosaicMember member = member_of(path, name, trust, options, **source);
  if (is_all_void(dynamic_cast<RasterSource&>(**source))) member.description.set_all_void(true);
  return member;
}

}  // namespace cordillera::raster
