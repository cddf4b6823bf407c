#include "pipeline/store/store_place.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>

#include "pipeline/store/mesh_files.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store_revise.h"
#include "proto/paths.h"
#include "raster/disk/write_all.h"

namespace cordillera::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBeside = ".building";

}  // namespace

proto::Result<StorePlace> StorePlace::replacing(const std::string& path, const proto::Plan& plan) {
  std::error_code error;
  const fs::path real = proto::behind_link(path, error);
  StorePlace place(path);
  if (error) return place;
  const std::string beside = real.string() + kBeside;
  auto lock = std::make_unique<raster::FileLock>(beside + ".lock");
  if (lock->others()) return store_write_problem(path, "another process is writing what is to take its place");
  place.lock_ = std::move(lock);
  const bool finished = note_in(real.string(), "manifest").has_value();
  if (finished && note_in(real.string(), "plan") != plan.SerializeAsString()) {
    place.path_ = beside;
    place.name_ = real.string();
  } else {
    place.left_ = beside;
  }
  return place;
}

proto::Result<void> StorePlace::settle() {
  if (!left_.empty()) remove_store(left_);
  if (name_.empty()) return {};
  // A log of the old file would be played into the new one. Readers of a finished file have none, so it loses nothing.
  remove_logs(name_);
  if (raster::put_in_place(path_, name_)) return {};
  return store_write_problem(name_, std::strerror(errno));
}

}  // namespace cordillera::pipeline
