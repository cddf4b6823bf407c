#include "server/datasets/list_texts.h"

namespace cordillera::server {
namespace {

constexpr std::size_t kMostTexts = 100'000;  // a kilobyte each

}  // namespace

std::string ListTexts::of(const Subject& subject, const Make& make) {
  const auto& [row, summary, path] = subject;
  std::shared_ptr<const std::string> text;
  {
    const std::lock_guard lock(mutex_);
    const auto known = known_.find(row->id);
    if (known != known_.end() && known->second.row == row && known->second.summary == summary && known->second.path == path)
      text = known->second.text;
  }
  if (text) return *text;
  text = std::make_shared<const std::string>(make());
  const std::lock_guard lock(mutex_);
  if (known_.size() >= kMostTexts) known_.clear();
  known_[row->id] = {row, summary, path, text};
  return *text;
}

void ListTexts::forget(const std::string& id) {
  const std::lock_guard lock(mutex_);
  known_.erase(id);
}

}  // namespace cordillera::server
