#pragma once
// Where GDAL can read a raster at any place in good time: the file itself, or a copy that many opened sources share.
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "proto/result.h"
#include "raster/disk/private_folder.h"
#include "raster/source.h"

namespace cordillera::raster {

struct AtHand {
  std::string path;                             ///< what GDAL is to open
  std::string name;                             ///< what the user called it, without folders; of an archive "dem.zip/N44W072.hgt"
  std::string file;                             ///< the last part of that
  std::shared_ptr<const PrivateFolder> folder;  ///< that path lies in, with its side files; null: the file is where it was
  int rows = 0;                                 ///< of a text grid's copy: those before the first that is damaged
};

/// Unpacked where it is an archive, and without the byte order mark that a text begins with. Of a file that has not changed the
/// same copy for all that ask, kept as long as one of them has it and a little longer: a build opens its raster several times.
/// Thread-safe.
proto::Result<AtHand> at_hand(const std::string& path, const std::string& name, Trust trust);

/// The points of a text as a GeoTIFF: GDAL reads all of them whenever it opens them. Shared and kept as above. key: the user's
/// file.
proto::Result<AtHand> gridded(const AtHand& points, const std::string& key, Trust trust);
/// Where that has been made.
std::optional<AtHand> known_grid(const AtHand& points, const std::string& key);

/// What copies of a file are kept by, as long as it stays as it is.
std::string copy_key(const std::string& path, const std::string& name);
/// Another copy of a raster, shared and kept as above: one of this key, or what `make` gives.
proto::Result<AtHand> shared_copy(const std::string& key, const std::function<proto::Result<AtHand>()>& make);

}  // namespace cordillera::raster
