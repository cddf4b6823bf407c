#pragma once
// What was used last, up to so many bytes.
#include <cstddef>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

namespace cordillera::proto {

/// Thread-safe. Values are copied out: hold large ones by a shared pointer.
template <class Key, class Value>
class Lru {
 public:
  explicit Lru(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  std::optional<Value> find(const Key& key) {
    const std::lock_guard lock(mutex_);
    const auto found = places_.find(key);
    if (found == places_.end()) return std::nullopt;
    entries_.splice(entries_.begin(), entries_, found->second);
    return entries_.front().value;
  }

  std::size_t bytes() const {
    const std::lock_guard lock(mutex_);
    return bytes_;
  }

  /// In place of what stands under the key.
  void replace(const Key& key, Value value, std::size_t bytes) {
    remove(key);
    keep(key, std::move(value), bytes);
  }

  void clear() {
    std::list<Entry> all;  // freed without the lock
    const std::lock_guard lock(mutex_);
    all.swap(entries_);
    places_.clear();
    bytes_ = 0;
  }

  void remove(const Key& key) {
    std::list<Entry> one;  // freed without the lock
    const std::lock_guard lock(mutex_);
    const auto found = places_.find(key);
    if (found == places_.end()) return;
    bytes_ -= found->second->bytes;
    one.splice(one.begin(), entries_, found->second);
    places_.erase(found);
  }

  /// All with keys from first to last, which is one of them.
  void remove_range(const Key& first, const Key& last) {
    std::list<Entry> all;  // freed without the lock
    const std::lock_guard lock(mutex_);
    for (auto at = places_.lower_bound(first); at != places_.end() && !(last < at->first); at = places_.erase(at)) {
      bytes_ -= at->second->bytes;
      all.splice(all.begin(), entries_, at->second);
    }
  }

  /// What is larger than everything that may be kept is not.
  void keep(const Key& key, Value value, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    if (bytes > most_bytes_ || places_.contains(key)) return;
    std::list<Entry> one;  // where memory is short for it, nothing has changed
    one.push_front({key, std::move(value), bytes});
    places_.emplace(key, one.begin());
    entries_.splice(entries_.begin(), one);
    for (bytes_ += bytes; bytes_ > most_bytes_;) {
      bytes_ -= entries_.back().bytes;
      places_.erase(entries_.back().key);
      entries_.pop_back();
    }
  }

 private:
  struct Entry {
    Key key;
    Value value;
    std::size_t bytes = 0;
  };
  mutable std::mutex mutex_;
  std::list<Entry> entries_;  // the last used first
  std::map<Key, typename std::list<Entry>::iterator> places_;
  std::size_t most_bytes_, bytes_ = 0;
};

}  // namespace cordillera::proto
