#include "server/datasets/archive.h"

#include <algorithm>

#include "server/datasets/dataset_folder.h"
#include "server/datasets/ledger.h"
#include "server/datasets/library.h"

namespace cordillera::server::updates {
namespace {

constexpr std::size_t kMostOpen = 16;
constexpr std::size_t kMostKept_bytes = std::size_t{64} << 20;  // of what they decoded, made and read, all but the last one

}  // namespace

std::shared_ptr<const pipeline::faces::Terrain> Archive::open(const std::string& id, std::uint32_t number) {
  return open_as(id, std::to_string(number), kept_store(layout_.dataset(id), number), {});
}

std::shared_ptr<const pipeline::faces::Terrain> Archive::open_as(const std::string& id, const std::string& name,
                                                                 const std::filesystem::path& store,
                                                                 const pipeline::Words& words) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(open_.begin(), open_.end(), [&](const Open& open) { return open.id == id && open.name == name; });
  if (found != open_.end()) {
    open_.splice(open_.begin(), open_, found);
    return open_.front().terrain;
  }
  auto reader = pipeline::open_store_with(store.string(), words);
  if (!reader) return nullptr;
  open_.push_front({id, name, std::make_shared<const pipeline::faces::Terrain>(std::move(reader).value())});
  std::size_t kept = 0;
  for (const Open& open : open_) kept += open.terrain->kept_bytes();
  while (open_.size() > 1 && (open_.size() > kMostOpen || kept > kMostKept_bytes)) {
    kept -= open_.back().terrain->kept_bytes();
    open_.pop_back();
  }
  return open_.front().terrain;
}

std::shared_ptr<const pipeline::faces::Terrain> Archive::find(const std::string& id, const std::string& version) {
  for (const std::uint32_t number : kept_numbers(layout_.dataset(id))) {
    auto terrain = open(id, number);
    if (terrain && version_of(terrain->manifest()) == version) return terrain;
  }
  return find_under_other_words(id, version);
}

/// A kept version may have been served under the words of now, too, which its build did not know.
std::shared_ptr<const pipeline::faces::Terrain> Archive::find_under_other_words(const std::string& id,
                                                                                const std::string& version) {
  const std::filesystem::path folder = layout_.dataset(id);
  FormerWords words = former_words(folder);
  const auto find_in = [&](const std::filesystem::path& store) -> std::shared_ptr<const pipeline::faces::Terrain> {
    for (std::size_t k = 0; k < words.size(); ++k) {
      auto terrain = open_as(id, store.filename().string() + " " + std::to_string(k), store, words[k]);
      if (terrain && version_of(terrain->manifest()) == version) return terrain;
    }
    return nullptr;
  };
  if (auto terrain = find_in(layout_.store(id))) return terrain;
  if (const auto record = read_record(folder)) words.push_back(words_of(record->options));
  for (const std::uint32_t number : kept_numbers(folder)) {
    if (auto terrain = find_in(kept_store(folder, number))) return terrain;
  }
  return nullptr;
}

void Archive::forget(const std::string& id) {
  const std::lock_guard lock(mutex_);
  open_.remove_if([&](const Open& open) { return open.id == id; });
}

}  // namespace cordillera::server::updates
