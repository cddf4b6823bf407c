#pragma once
// Several rasters as one Source: where they overlap the first in the list that has data wins, and its voids are filled by the
// next.
#include <memory>
#include <string>
#include <vector>

#include "raster/mosaic/member_windows.h"
#include "raster/mosaic/pixel_grid.h"
#include "raster/source.h"

namespace cordillera::raster {

/// One raster of a mosaic. options: those of the build with the raster's own put over them; trust as for open_source.
struct MosaicMember {
  std::string path, name;
  Trust trust = Trust::operator_file;
  proto::BuildOptions options;
  proto::Source description;
  Source::Window window;                           ///< on kMemberLattice
  std::string state;                               ///< of the file, when it was examined
  std::string datum;                               ///< Source::datum_print
  PixelGrid grid{};                                ///< of its pixels
  std::shared_ptr<const Decimation> decimation{};  ///< read in place of its pixels; null: those
};

/// Opens the raster once to see where it lies and what it is. Its problems name it.
proto::Result<MosaicMember> examine(const std::string& path, const std::string& name, Trust trust,
                                    const proto::BuildOptions& options);

/// Whether a problem of examine() is that the bbox does not touch the raster: among others it is passed over.
bool lies_beside(const proto::Problem& problem);
/// The problem where it touches none of several. asked: path, name, trust and options of each; some are opened without the bbox.
proto::Problem beside_all(const std::vector<MosaicMember>& asked);

/// As examine, and looks at the pixels, too: description.all_void says where none has data.
proto::Result<MosaicMember> examine_pixels(const std::string& path, const std::string& name, Trust trust,
                                           const proto::BuildOptions& options);

/// Members that were cut from one grid (the same CRS, vertical datum and size of pixels) are interpolated across their
/// common sides, and between their outermost points, as if they were one raster. feather_m: the width over which a raster gives
/// way to those below it, towards its rims and voids; 0: it ends in a step. Heights are blended in whole steps, and a vertex's
/// height depends on nothing but the members around it, or around the pole that it is. Members are opened when their place is
/// asked for, the last few are kept open. At least one member; not thread-safe, as every Source.
std::unique_ptr<Source> make_mosaic(std::vector<MosaicMember> members, double feather_m);

}  // namespace cordillera::raster
