#include "raster/storage/block_cache.h"

namespace cordillera::raster {

std::uint64_t BlockCache::new_file() {
  const std::lock_guard lock(mutex_);
  return ++files_;
}

BlockCache::Piece BlockCache::find(const Key& key) {
  const std::lock_guard lock(mutex_);
  const auto place = places_.find(key);
  if (place == places_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, place->second);
  return place->second->second;
}

void BlockCache::keep(const Key& key, Piece piece) {
  const std::lock_guard lock(mutex_);
  if (piece->size() > most_ || places_.contains(key)) return;
  while (bytes_ + piece->size() > most_) drop(std::prev(entries_.end()));
  bytes_ += piece->size();
  entries_.emplace_front(key, std::move(piece));
  places_[key] = entries_.begin();
}

void BlockCache::forget(std::uint64_t file) {
  const std::lock_guard lock(mutex_);
  while (true) {
    const auto place = places_.lower_bound({file, 0});
    if (place == places_.end() || place->first.first != file) return;
    drop(place->second);
  }
}

std::uint64_t BlockCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

void BlockCache::drop(Entries::iterator entry) {
  bytes_ -= entry->second->size();
  places_.erase(entry->first);
  entries_.erase(entry);
}

}  // namespace cordillera::raster
