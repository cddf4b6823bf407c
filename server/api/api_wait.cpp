// Requests that wait for tiles of a dataset that is being built. They hold no thread: the front asks them again.
#include <algorithm>
#include <chrono>
#include <cstdio>

#include "server/api/api.h"
#include "server/api/requests/prefer.h"
#include "server/jobs/provisional.h"

namespace cordillera::server {
namespace {

using Clock = std::chrono::steady_clock;

// The loops of connections look, and the job is told by a file: hundreds that wait must not write it with every step of a build.
constexpr std::chrono::seconds kBetweenLooks{1};

// Many proxies give up after 60 s, and who waits behind one is then not told when to ask again.
constexpr std::chrono::seconds kLongestOfWhole{25};

/// From the share clients see that waiting helps.
Response not_yet(Service& service, const Dataset& dataset, const std::string& why) {
  char share[16] = "";
  std::snprintf(share, sizeof share, "%.1f %%", 100 * share_made(service, dataset));
  return problem_response({"tile-not-ready", why + "; " + share + " of the dataset is built",
                           "asking again, or Prefer: wait=SECONDS within the limit max_wait", ""});
}

Response not_all_made_yet(Service& service, const Dataset& dataset) {
  return not_yet(service, dataset, "this is made of all of dataset " + dataset.id + ", the rest of which is built now");
}

class TileWait {
 public:
  TileWait(Service& service, std::string id, const MayWait& wait, Awaited awaited, Token place)
      : service_(service), id_(std::move(id)), wait_(wait), awaited_(std::move(awaited)), place_(std::move(place)) {}

  std::optional<Response> ask(Patience patience) {
    const std::uint64_t changes = service_.library().changes();
    const bool news = seen_ != changes, looks = Clock::now() - looked_ >= kBetweenLooks;
    seen_ = changes;
    if ((news || looks) && !lacks(looks)) return over("made", anew());
    if (patience == Patience::none) return over("left", refusal());
    if (service_.stopping() || Clock::now() - began_ >= wait_.longest) return over("timeout", at_the_end());
    return std::nullopt;
  }

 private:
  /// looks: again, on the way, for what a step shows may be what others have asked for since.
  bool lacks(bool looks) {
    const Row dataset = service_.find(id_);
    if (!dataset || dataset->state == State::ready || dataset->state == State::failed) return false;
    const auto terrain = service_.library().provisional(id_);
    if (!awaited_.lacks(*dataset, terrain.get())) return false;
    if (terrain && awaited_.alone && ahead_of_block(service_.library(), id_, terrain->manifest(), *awaited_.alone)) return false;
    if (!terrain || !looks) return true;
    looked_ = Clock::now();
    if (awaited_.all && is_lazy(*dataset)) service_.queue().look_at_all(*dataset);
    std::vector<proto::TileAddress> to_come;
    for (const proto::TileAddress& tile : awaited_.tiles) {
      if (to_come.size() == kMostLooks) break;
      if (is_to_come(*dataset, &terrain->manifest(), tile)) to_come.push_back(tile);
    }
    service_.queue().look_again(*dataset, std::move(to_come), terrain->manifest());
    return true;
  }

  /// Who names no time gets what there is by then.
  Response at_the_end() const {
    return !wait_.preferred && !service_.stopping() && service_.library().provisional(id_) ? anew() : refusal();
  }

  Response refusal() const {
    const Row dataset = service_.find(id_);
    if (!dataset) return problem_response(unknown_dataset(id_));
    return awaited_.all ? not_all_made_yet(service_, *dataset) : not_made_yet(service_, *dataset);
  }

  static Response anew() {
    Response response;
    response.anew = true;
    return response;
  }

  Response over(const char* outcome, Response response) const {
    const std::chrono::duration<double> waited = Clock::now() - began_;
    service_.metrics().tile_wait_seconds.observe(waited.count(), {outcome});
    if (wait_.preferred) response.set("Preference-Applied", "wait=" + std::to_string(wait_.longest.count()));
    return response;
  }

  Service& service_;
  const std::string id_;
  const MayWait wait_;
  const Awaited awaited_;
  const Token place_;
  const Clock::time_point began_ = Clock::now();
  Clock::time_point looked_{};         ///< when it did so last; the request itself may have looked before
  std::optional<std::uint64_t> seen_;  ///< of the library's changes; nothing at first
};

}  // namespace

MayWait may_wait(const Limits& limits, const Request& request) {
  const auto preferred = preferred_wait(request);
  const std::chrono::seconds most(limits.wait_seconds);
  return {std::min(preferred.value_or(most), most), preferred.has_value()};
}

MayWait may_wait_for_whole(const Limits& limits, const Request& request) {
  MayWait wait = may_wait(limits, request);
  if (!wait.preferred) wait.longest = std::min(wait.longest, kLongestOfWhole);
  if (request.method == "HEAD") wait.longest = std::chrono::seconds(0);
  return wait;
}

std::optional<Response> wait_for(Service& service, const Request& request, const Dataset& dataset, const MayWait& wait,
                                 Awaited awaited) {
  if (request.waited || wait.longest.count() == 0) return std::nullopt;
  Token place = service.wait_token(Service::WaitsFor::tiles);
  if (!place) {
    service.metrics().tile_wait_seconds.observe(0, {"refused"});
    return std::nullopt;
  }
  Response response;
  response.later = [waiting = std::make_shared<TileWait>(service, dataset.id, wait, std::move(awaited), std::move(place))](
                       Patience patience) { return waiting->ask(patience); };
  return response;
}

std::optional<Response> wait_for_all(Service& service, const Request& request, const Dataset& dataset) {
  if (dataset.state != State::queued && dataset.state != State::running) return std::nullopt;
  const MayWait wait = may_wait_for_whole(service.settings().serve.limits, request);
  const auto shown = service.library().provisional(dataset.id);
  const bool lazy = is_lazy(dataset);
  if (!lazy && !wait.preferred) return std::nullopt;
  if (lazy && shown) service.queue().look_at_all(dataset);
  Awaited awaited{{}, [](const Dataset&, const pipeline::faces::Terrain*) { return true; }};
  awaited.all = true;
  auto later = wait_for(service, request, dataset, wait, std::move(awaited));
  return later ? std::move(*later) : not_all_made_yet(service, dataset);
}

Awaited all_of(std::vector<proto::TileAddress> tiles) {
  const auto lacks = [tiles](const Dataset& dataset, const pipeline::faces::Terrain* shown) {
    return std::any_of(tiles.begin(), tiles.end(), [&](const proto::TileAddress& tile) {
      return is_to_come(dataset, shown == nullptr ? nullptr : &shown->manifest(), tile);
    });
  };
  return {std::move(tiles), lacks};
}

Response not_made_yet(Service& service, const Dataset& dataset) {
  return not_yet(service, dataset, "dataset " + dataset.id + " is being built, and has not come to this yet: it is made next");
}

std::shared_ptr<const pipeline::faces::Terrain> ahead_of_block(Library& library, const std::string& id,
                                                               const proto::Manifest& shown, const proto::TileAddress& tile) {
  const int level = static_cast<int>(shown.done_blocks().level());
  if (!shown.has_done_blocks() || tile.z <= level) return nullptr;
  auto terrain = library.finest(id, tile.at_level(level));
  return terrain && terrain->store().record(tile) ? terrain : nullptr;
}

bool is_to_come(const Dataset& dataset, const proto::Manifest* shown, const proto::TileAddress& tile) {
  if (shown == nullptr || !shown->has_done_blocks()) return true;
  const bool above = tile.z < static_cast<int>(shown->done_blocks().level());
  return above ? !is_lazy(dataset) : waits_for_block(*shown, tile);
}

}  // namespace cordillera::server
