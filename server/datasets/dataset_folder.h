#pragma once
// What a dataset's folder says of itself, so that a row that was lost can be made again, and how a folder goes.
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "pipeline/store/store_words.h"
#include "proto/result.h"
#include "server/data/layout.h"
#include "server/datasets/registry.h"

namespace cordillera::server {

inline constexpr const char* kRecordFile =
    "dataset.json";  ///< the row but for its state; written before the folder gets its name, and before the row changes
inline constexpr const char* kDeletedFile =
    "deleted.json";  ///< the same of a dataset that was deleted: without a row it is no lost one

inline constexpr const char* kFetchedFile =
    "fetched.json";  ///< what the server said of the raster that was fetched: whether it is still the same

inline constexpr const char* kListedFile = "listed.json";  ///< where that was a list: the same of each raster that it names

/// Whether a file's name is one of these, which stay as long as the folder does.
inline bool is_record(const std::filesystem::path& name) {
  return name == kRecordFile || name == kDeletedFile || name == kFetchedFile || name == kListedFile;
}

/// What a dataset was called before, the last one first. Its record alone has them.
using FormerWords = std::vector<pipeline::Words>;
pipeline::Words words_of(const proto::BuildOptions& options);

/// Problems: "storage-full"; "dataset-unknown" where the folder is not there, which is not made anew.
proto::Result<void> write_record(const std::filesystem::path& folder, const Dataset& dataset, const FormerWords& former = {});
/// Empty where there is no record.
FormerWords former_words(const std::filesystem::path& folder);
/// None: there is none, or it is of another dataset than the folder's name says.
std::optional<Dataset> read_record(const std::filesystem::path& folder);

/// Before the row is taken away. False: it is not on disk.
bool mark_deleted(const std::filesystem::path& folder);
/// The row could not be taken away.
void unmark_deleted(const std::filesystem::path& folder);
bool is_marked_deleted(const std::filesystem::path& folder);

/// Of a folder that is marked: removes all but the mark.
void empty_marked_folder(const std::filesystem::path& folder);

/// Whether all is done that the first build of the dataset had to do: its store is published, and no raster waits to be built.
bool is_built(const Layout& layout, const Dataset& dataset);

/// Takes it out of datasets/ in one step, so that no half of it is found there, then removes it. A folder that is not there is
/// gone.
std::error_code remove_dataset_folder(const Layout& layout, const std::string& id);

}  // namespace cordillera::server
