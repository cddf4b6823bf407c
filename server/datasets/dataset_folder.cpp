#include "server/datasets/dataset_folder.h"

#include <cerrno>
#include <fstream>
#include <vector>

#include "pipeline/store/store.h"
#include "proto/files.h"
#include "raster/disk/new_file.h"
#include "raster/disk/write_all.h"
#include "server/datasets/ledger.h"
#include "server/datasets/library.h"
#include "server/datasets/upload.h"
#include "server/http/digest.h"
#include "server/http/json.h"
#include "work.pb.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

proto::DatasetRecord record_of(const Dataset& dataset) {
  proto::DatasetRecord record;
  record.set_id(dataset.id);
  record.set_name(dataset.name);
  record.set_created(dataset.created);
  record.set_raster(dataset.raster);
  *record.mutable_options() = dataset.options;
  record.set_owner(dataset.owner);
  record.set_hidden(dataset.is_private);
  record.set_idempotency_key(dataset.idempotency_key);
  record.set_options_hash(dataset.options_hash);
  record.set_body_hash(dataset.body_hash);
  record.set_request_id(dataset.request_id);
  record.set_address(dataset.address);
  return record;
}

Dataset dataset_of(const proto::DatasetRecord& record) {
  Dataset dataset;
  dataset.id = record.id();
  dataset.name = record.name();
  dataset.created = record.created();
  dataset.raster = record.raster();
  dataset.options = record.options();
  dataset.owner = record.owner();
  dataset.is_private = record.hidden();
  dataset.idempotency_key = record.idempotency_key();
  dataset.options_hash = record.options_hash();
  dataset.body_hash = record.body_hash();
  dataset.request_id = record.request_id();
  dataset.address = record.address();
  return dataset;
}

std::optional<proto::DatasetRecord> record_in(const fs::path& folder) {
  const auto text = proto::bytes_of_file(folder / kRecordFile);
  proto::DatasetRecord record;
  if (!text || !from_json(*text, &record) || record.id() != folder.filename().string()) return std::nullopt;
  return record;
}

}  // namespace

pipeline::Words words_of(const proto::BuildOptions& options) {
  return {options.title(), options.attribution(), options.imagery()};
}

proto::Result<void> write_record(const fs::path& folder, const Dataset& dataset, const FormerWords& former) {
  proto::DatasetRecord record = record_of(dataset);
  for (const pipeline::Words& words : former) {
    proto::FormerWords& one = *record.add_former();
    one.set_title(words.title.value_or(""));
    one.set_attribution(words.attribution.value_or(""));
    one.set_imagery(words.imagery.value_or(""));
  }
  // Not with write_whole(), which makes the folder where it is not there: the dataset may be deleted at this moment.
  const fs::path next = folder / (std::string(kRecordFile) + "." + random_letters(8) + ".part");
  do {
    raster::NewFile out(next, 0666);
    if (!out.is_open() && errno == ENOENT) return unknown_dataset(dataset.id);
    if (out.is_open() && out.write(to_json_line(record) + "\n") && out.close() &&
        raster::put_in_place(next, folder / kRecordFile))
      return {};
  } while (errno == ENOENT);  // a build that ends has removed all but its store and the records
  std::error_code ignored;
  fs::remove(next, ignored);
  return proto::Problem{"storage-full", "what was posted cannot be written down: the disk is full or fails",
                        "trying again when there is room", ""};
}

std::optional<Dataset> read_record(const fs::path& folder) {
  const auto record = record_in(folder);
  if (!record) return std::nullopt;
  Dataset dataset = dataset_of(*record);
  return stays_in_its_folder(dataset) ? std::optional(std::move(dataset)) : std::nullopt;
}

FormerWords former_words(const fs::path& folder) {
  FormerWords all;
  const auto record = record_in(folder);
  if (!record) return all;
  for (const proto::FormerWords& one : record->former()) all.push_back({one.title(), one.attribution(), one.imagery()});
  return all;
}

bool mark_deleted(const fs::path& folder) {
  std::error_code error;
  // With its disk away nothing is deleted: the dataset would be there again with the disk.
  if (!fs::exists(folder, error)) return !error && fs::is_directory(folder.parent_path(), error);
  fs::rename(folder / kRecordFile, folder / kDeletedFile, error);  // needs no room: a full disk can be cleaned up
  if (error && !std::ofstream(folder / kDeletedFile)) return false;
  return raster::sync_path(folder);
}

void unmark_deleted(const fs::path& folder) {
  std::error_code error;
  if (fs::file_size(folder / kDeletedFile, error) > 0 && !error) {
    fs::rename(folder / kDeletedFile, folder / kRecordFile, error);
  } else {
    fs::remove(folder / kDeletedFile, error);
  }
}

bool is_marked_deleted(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / kDeletedFile, error);
}

void empty_marked_folder(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> held;
  for (fs::directory_iterator at(folder, error); !error && at != fs::directory_iterator(); at.increment(error)) {
    if (at->path().filename() != kDeletedFile) held.push_back(at->path());
  }
  for (const fs::path& file : held) fs::remove_all(file, error);
}

bool is_built(const Layout& layout, const Dataset& dataset) {
  std::error_code error;
  const fs::path folder = layout.dataset(dataset.id);
  // Rasters of changes are kept for good, and a version is put into its place whole: one that cannot be read is damaged, not
  // unfinished.
  if (updates::is_changeable(folder)) return fs::exists(layout.store(dataset.id), error);
  // A raster that is there belongs to a build that did not end; what it committed is its own to judge.
  if (!dataset.raster.empty() && fs::exists(folder / dataset.raster, error)) return false;
  return fs::exists(layout.store(dataset.id), error) &&
         pipeline::StoreReader::manifest_of(layout.store(dataset.id).string()).ok();
}

std::error_code remove_dataset_folder(const Layout& layout, const std::string& id) {
  std::error_code error;
  const fs::path away = layout.removed() / id;
  fs::create_directory(layout.removed(), error);  // in the data folder, which is not made anew
  fs::rename(layout.dataset(id), away, error);
  if (error == std::errc::no_such_file_or_directory) return {};
  std::error_code removed;
  fs::remove_all(error ? layout.dataset(id) : away, removed);
  return removed;
}

}  // namespace cordillera::server
