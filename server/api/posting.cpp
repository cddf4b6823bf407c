#include "server/api/posting.h"

#include "server/api/api_updates.h"
#include "server/api/public_address.h"
#include "server/api/requests/typed_by_hand.h"
#include "server/http/digest.h"
#include "server/http/json.h"
#include "server/options/request_policy.h"

namespace cordillera::server {
namespace {

/// The option that does not go with blocks which are made one by one; null: none.
const char* against_lazy(const proto::BuildOptions& build) {
  if (build.has_provisional() && !build.provisional()) return "provisional";
  return build.keep_size() > 0 ? "keep" : nullptr;
}

/// Whether a raster at an address is read where it stands, as that of /v1/live, or copied. It is copied for updates=1 and
/// build=full, also where the operator said the latter. Nobody is refused for a default: what does not go with lazy has it
/// copied.
bool stays_at_its_address(const Given& given, const std::optional<bool>& updates, const Settings& settings) {
  const std::string& said = settings.build.build();  // by the request, else by the operator; empty: by nobody
  if (updates && *updates) return false;
  if (is_given(given, "build")) return said == kLazy;
  if (settings.dry_run || against_lazy(settings.build) != nullptr) return false;
  return said != kFull || updates;  // updates=0 is the request's own word against a copy
}

std::optional<proto::Problem> take_address(const Given& given, const std::optional<bool>& updates, Posting& posting) {
  const bool fetched = !posting.delivery.address.empty();
  posting.again = fetched && stays_at_its_address(given, updates, posting.settings);
  // updates=1 is of the service alone: no build differs for it but in its blocks. A raster that is copied from an address is
  // kept, as those of updates=1 are.
  posting.updates = !posting.again && updates.value_or(fetched);
  if (!posting.again) return std::nullopt;
  posting.settings.build.set_build(kLazy);
  if (!posting.settings.dry_run) return std::nullopt;
  return proto::Problem{"options-conflict", "a dry run looks at a raster that is sent", "one of them", "dry_run"};
}

/// build=lazy shows blocks in the place of provisional tiles. Where the service has it as its default, other posts are built in
/// full.
std::optional<proto::Problem> take_lazy(bool asked, Posting& posting) {
  proto::BuildOptions& build = posting.settings.build;
  const char* against = build.build() == kLazy ? against_lazy(build) : nullptr;
  if (against == nullptr) return std::nullopt;
  if (asked) {
    return proto::Problem{"options-conflict",
                          std::string("build=lazy makes blocks one by one, in the place of provisional tiles; ") + against +
                              "= does not go with it",
                          std::string("build=full, or a POST without ") + against + "=", "build"};
  }
  build.clear_build();
  return std::nullopt;
}

}  // namespace

proto::Result<Posting> read_posting(Service& service, const Request& request, RasterIs raster) {
  Posting posting;
  posting.folder = public_path(request, "");
  Given given = request.query;
  if (const std::string name = name_in_path(request); !name.empty() && !is_given(given, "name")) given.emplace_back("name", name);
  PostWords words{service.settings(), {}, {}};
  if (auto problem = read_layer(post_words(), given, Spelling::query, words, words.settings)) return *problem;
  static_cast<RasterWords&>(posting.delivery) = words.raster;
  posting.settings = std::move(words.settings);
  if (auto refused = take_address(given, words.updates, posting)) return *refused;
  if (auto refused = take_lazy(is_given(given, "build"), posting)) return *refused;
  if (auto refused = posting.settings.private_dataset ? service.gate().refuse_private() : std::nullopt) return *refused;
  if (auto refused = apply_policy(service.settings(), posting.settings.build)) return *refused;
  if (auto refused = check_delivery(service.settings().serve, request, raster, posting.delivery)) return *refused;
  if (!posting.delivery.address.empty() && !posting.updates && !posting.again) {
    return proto::Problem{"options-conflict", "a raster that is copied from an address is kept, as those of updates=1 are",
                          "source= without updates=0, or with build=lazy", "source"};
  }
  if (posting.updates && posting.settings.dry_run) {
    return proto::Problem{"options-conflict", "a dry run keeps nothing that could be updated", "one of them", "updates"};
  }
  const std::string& name = posting.settings.build.name();
  posting.name = name.empty() ? updates::name_of(service, posting.delivery) : name;
  if (posting.name.empty()) posting.name = "raster";
  if (!posting.settings.dry_run) posting.delivery.key_by_upload();
  posting.options_hash =
      digest(to_json_line(posting.settings.build) + (posting.settings.dry_run ? "dry" : "") +
             (posting.settings.private_dataset ? "private" : "") + (posting.updates ? "updates" + posting.delivery.address : "") +
             (posting.again ? "again" + posting.delivery.address : ""));
  return posting;
}

std::optional<proto::Problem> take_several(const Request& request, Posting& posting) {
  if (posting.settings.dry_run)
    return proto::Problem{"options-conflict", "a dry run looks at one raster, and the form has several", "one of them",
                          "dry_run"};
  if (is_given(request.query, "updates") && !posting.updates)
    return proto::Problem{"options-conflict", "several rasters are kept, as those of updates=1 are",
                          "several files without updates=0", "updates"};
  posting.updates = true;
  return std::nullopt;
}

}  // namespace cordillera::server
