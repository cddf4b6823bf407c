// DELETE of a dataset.
#include <mutex>

#include "server/api/api.h"
#include "server/datasets/dataset_folder.h"
#include "server/limits/disk.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

/// Not even the registry's log can grow.
bool is_full(const std::filesystem::path& folder) {
  constexpr std::uint64_t kRoomOfLog = 1 << 20;
  const auto disk = limits::disk_space(folder);
  return disk && disk->free < kRoomOfLog;
}

/// From here on there is no such dataset, and a start that misses its row does not take its folder for a lost one. False: it is
/// still there, or somebody else has removed it meanwhile.
bool forget_row(Service& service, const std::string& id) {
  static std::mutex one_by_one;  // who comes second must not mark, or unmark, a folder that is being removed
  const std::lock_guard alone(one_by_one);
  if (!service.registry().find(id)) return false;
  const std::filesystem::path folder = service.layout().dataset(id);
  const bool marked = mark_deleted(folder);
  const auto remove_row = [&] { service.ledger().apart([&] { service.registry().remove(id); }); };
  try {
    if (marked) remove_row();
  } catch (const RegistryError&) {
    if (!is_full(folder)) {
      unmark_deleted(folder);
      throw;
    }
    // There is no room to write down that something goes. So it goes first; a start that finds the mark removes the row.
    empty_marked_folder(folder);
    remove_row();
  }
  if (!marked) unmark_deleted(folder);
  return marked;
}

}  // namespace

std::optional<Response> refuse_mounted(const Dataset& dataset) {
  if (!dataset.mounted) return std::nullopt;
  auto response =
      problem_response({"method-not-allowed", "dataset " + dataset.id + " was published elsewhere; this service only reads it",
                        "GET, HEAD, OPTIONS", ""});
  response.set("Allow", "GET, HEAD, OPTIONS");
  return response;
}

Response remove_dataset(Service& service, const Request& request, const Dataset& dataset) {
  const std::string id = dataset.id;
  if (auto refused = refuse_mounted(dataset)) return std::move(*refused);
  if (request.who.role < access::Role::admin && dataset.owner != request.who.name) {
    return problem_response({"role-too-low", "the token '" + request.who.name + "' did not post dataset " + id,
                             "the token that did, or one with the role admin", "Authorization"});
  }
  const bool deleted = delete_dataset(service, id);
  if (!deleted && !service.find(id)) return problem_response(unknown_to(request, id));
  if (!deleted)
    return problem_response(
        {"storage-full", "the deletion cannot be written down; nothing was changed", "trying again later", ""});
  Response response;
  response.status = 204;
  return response;
}

bool delete_dataset(Service& service, const std::string& id) {
  if (!forget_row(service, id)) return false;
  service.queue().cancel(id);
  service.hub().forget(id);
  service.forget(id);
  const std::error_code error = remove_dataset_folder(service.layout(), id);
  service.forget(id);  // again, for who opened it meanwhile
  if (error) log_warning("dataset " + id + ": cannot remove its folder: " + error.message());
  log_info("dataset " + id + ": deleted");
  return true;
}

}  // namespace cordillera::server
