#pragma once
// A published dataset that is read where it lies: in object storage, or in a file that another may replace.
#include <memory>

#include "pipeline/store/store.h"
#include "raster/storage/object_file.h"

namespace cordillera::pipeline {

/// Reads only what is asked for, from the file as it is now: reads throw StoreError once another one has its name, or when the
/// storage does not answer; the file knows which. "storage-read", "storage-changed" when that happens here.
proto::Result<std::unique_ptr<StoreReader>> open_store(std::shared_ptr<raster::ObjectFile> file);

}  // namespace cordillera::pipeline
