#include "server/front/answer_budget.h"

namespace cordillera::server::front {

bool AnswerBudget::Used::has_room(const Bytes& wanted, std::size_t most) const {
  return bytes == 0 || holders.contains(wanted.get()) || bytes + wanted->size() <= most;
}

void AnswerBudget::Used::add(const Bytes& more) {
  if (++holders[more.get()] == 1) bytes += more->size();
}

void AnswerBudget::Used::remove(const Bytes& less) {
  const auto its = holders.find(less.get());
  if (--its->second > 0) return;
  holders.erase(its);
  bytes -= less->size();
}

AnswerBudget::Share AnswerBudget::take(const std::string& client, const Bytes& bytes) {
  const std::lock_guard lock(mutex_);
  const auto known = clients_.find(client);
  const bool client_has_room = known == clients_.end() || known->second.has_room(bytes, most_per_client_);
  if (!client_has_room || !all_.has_room(bytes, most_)) return nullptr;
  clients_[client].add(bytes);
  all_.add(bytes);
  return {this, [client, bytes](void* budget) { static_cast<AnswerBudget*>(budget)->give_back(client, bytes); }};
}

bool AnswerBudget::full(const std::string& client) const {
  const std::lock_guard lock(mutex_);
  const auto known = clients_.find(client);
  return all_.bytes >= most_ || (known != clients_.end() && known->second.bytes >= most_per_client_);
}

std::size_t AnswerBudget::all() const {
  const std::lock_guard lock(mutex_);
  return all_.bytes;
}

void AnswerBudget::give_back(const std::string& client, const Bytes& bytes) {
  const std::lock_guard lock(mutex_);
  const auto its = clients_.find(client);
  its->second.remove(bytes);
  if (its->second.holders.empty()) clients_.erase(its);
  all_.remove(bytes);
}

}  // namespace cordillera::server::front
