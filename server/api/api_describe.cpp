// PATCH /v1/datasets/{id}: what of a dataset may change without a build: its title, its attribution, its imagery, and who may
// read it. And build=full, after which what a lazy build has not made is made.
#include <algorithm>
#include <mutex>

#include "server/api/api.h"
#include "server/api/api_updates.h"
#include "server/api/requests/typed_by_hand.h"
#include "server/datasets/dataset_folder.h"
#include "server/http/conditions.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

using proto::Problem;

constexpr const char* kDescribable =
    "title, attribution, imagery, private and build, as JSON, in the query or as curl -d sends them";

/// What a dataset need not have: null takes it away, as an empty text does.
const TextMembers kTexts = {"title", "attribution", "imagery"};

/// Those under which addresses of versions go on: as many as are kept of changed rasters.
FormerWords words_after(const std::filesystem::path& folder, const Dataset& before, const Dataset& changed,
                        const ServeSettings& serve) {
  FormerWords former = former_words(folder);
  const pipeline::Words were = words_of(before.options);
  if (were != words_of(changed.options)) former.insert(former.begin(), were);
  former.resize(std::min<std::size_t>(former.size(), serve.keep_versions));
  return former;
}

std::mutex g_describing;

/// With the lock of Ledger::apart.
proto::Result<void> write_words(Service& service, const Request& request, const Given& words, const std::string& id) {
  const Row before = service.registry().find(id);
  if (!before) return unknown_to(request, id);
  Dataset changed = *before;
  const TableWords table{.what = "a dataset's", .of = " does not change without a build", .accepted = kDescribable};
  if (auto wrong = read_options(description_words(), words, table, changed)) return *wrong;
  if (auto refused = changed.is_private ? service.gate().refuse_private() : std::nullopt) return *refused;
  // First beside the tiles: a registry that is lost then knows no less of who may read them.
  const auto folder = service.layout().dataset(id);
  const auto written = write_record(folder, changed, words_after(folder, *before, changed, service.settings().serve));
  // One that failed, or is still to be fetched, has no folder. Its row has the words then.
  if (!written && written.problem().type != "dataset-unknown") return written;
  service.registry().describe(id, changed.options, changed.is_private);
  return {};
}

/// Under the lock in which a deletion takes the row away: what is written into the folder of a deleted dataset would be one again
/// at the next start.
proto::Result<void> described_anew(Service& service, const Request& request, const Given& words, const std::string& id) {
  proto::Result<void> done;
  service.ledger().apart([&] { done = write_words(service, request, words, id); });
  return done;
}

}  // namespace

Response describe_dataset(Service& service, const Request& request, const Dataset& dataset) {
  if (auto mounted = refuse_mounted(dataset)) return std::move(*mounted);
  if (auto refused = updates::refuse(request, dataset)) return problem_response(*refused);
  const bool bodiless = !request.header("transfer-encoding") && request.header("content-length").value_or("0") == "0";
  const std::string type = request.header("content-type").value_or("");
  if (!bodiless && type.starts_with("multipart/"))
    return problem_response({"body-form", "the body is a form of several parts", kDescribable, ""});
  const bool fields = type.starts_with("application/x-www-form-urlencoded");  // curl -d title=Hills
  auto plain = bodiless ? proto::Result<Request>(request)
               : fields ? with_typed_body_as_query(request, &kTexts)
                        : with_json_as_query(request, &kTexts);
  if (fields && plain && plain->read_body) plain = with_json_as_query(*plain, &kTexts);
  if (!plain) return problem_response(plain.problem());
  if (plain->query.empty()) return problem_response({"option-invalid", "nothing is to change", kDescribable, ""});
  // As it is by now: while the body came, another request may have changed it. One at a time, so that none is undone by the next.
  const std::lock_guard alone(g_describing);
  const Row before = service.registry().find(dataset.id);
  if (!before) return problem_response(unknown_to(request, dataset.id));  // deleted meanwhile
  if (request.headers.contains("if-match")) {
    const std::string tag = status_document(service, request, *before).header("ETag");
    if (!if_match_holds(request, tag)) return problem_response(condition_failed("If-Match", tag));
  }
  if (const auto described = described_anew(service, request, plain->query, dataset.id); !described)
    return problem_response(described.problem());
  (void)service.live().note_read(*before, sender(request));  // one that is asleep could not be built
  const Row now = service.registry().find(dataset.id);
  if (!now) return problem_response(unknown_to(request, dataset.id));
  service.forget(dataset.id);
  service.hub().touch(dataset.id);
  log_info("dataset " + dataset.id + ": described anew");
  if (is_lazy(*before) && !is_lazy(*now) && (now->state == State::running || now->state == State::queued))
    service.queue().enqueue(dataset.id, sender(request));
  return status_document(service, request, *now);
}

}  // namespace cordillera::server
