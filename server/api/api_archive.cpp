// GET /v1/datasets/{id}.pmtiles: all tiles of a format as one archive, whole or by ranges.
#include <algorithm>
#include <chrono>

#include "pipeline/exports/mbtiles.h"
#include "pipeline/exports/pmtiles.h"
#include "server/api/api.h"
#include "server/http/byte_range.h"
#include "server/log/log.h"
#include "server/options/table_reader.h"

namespace cordillera::server {
namespace {

using pipeline::faces::Face;
using proto::Problem;

constexpr std::size_t kAtOnce_bytes = std::size_t{1} << 20;  // of a part that is read into memory
constexpr std::size_t kPiece_bytes = std::size_t{64} << 10;  // of what is larger

/// format= of the query, or pictures of heights: most programs that open such archives are maps.
proto::Result<const Face*> face_asked(const Request& request) {
  static const std::vector<OptionOf<std::string>> kOptions = {
      {"format", "", "", "", [](std::string_view text, std::string& format) { return format = text, Complaint(); }}};
  std::string wanted, names;
  if (auto problem = read_options(kOptions, request.query, {.of = " of an archive"}, wanted)) return *problem;
  for (const Face* face : pipeline::faces::all_faces()) {
    if (!pipeline::exports::fits_pmtiles(*face)) continue;
    if (wanted.empty() ? pipeline::exports::fits_mbtiles(*face) : face->name == wanted) return face;
    names.append(names.empty() ? "" : ", ").append(face->name);
  }
  return wrong_value("format", wanted, "an archive holds no such format", names);
}

/// Piece after piece of a file that is too large for the memory.
class Pieces {
 public:
  Pieces(std::shared_ptr<const ArchiveFile> file, ByteRange part) : file_(std::move(file)), part_(part) {}
  std::optional<std::string> next() {
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(part_.size, kPiece_bytes));
    if (count == 0) return std::nullopt;
    std::string piece = file_->read(part_.first, count);
    part_.first += count, part_.size -= count;
    return piece;
  }

 private:
  std::shared_ptr<const ArchiveFile> file_;
  ByteRange part_;
};

/// Of damage it is said where all damage is.
Response archive_refusal(Service& service, const std::string& id, const proto::Problem& why) {
  return problem_response(why.type == "store-damaged" ? service.library().damaged(id, "no archive: " + why.detail) : why);
}

Response still_made() {
  return problem_response({"archive-not-ready", "the archive is being made", "asking again in a moment", ""});
}

Response answer_file(const Request& request, const std::shared_ptr<const ArchiveFile>& file, const Route& route) {
  Response response;
  response.set("Content-Type", "application/vnd.pmtiles");
  response.set("Content-Disposition", "inline; filename=\"" + route.id + ".pmtiles\"");
  response.set("Cache-Control", cache_control(route));
  response.set("ETag", file->etag());
  response.set("Accept-Ranges", "bytes");
  if (auto unchanged = if_changed(request, response); unchanged.status == 304) return unchanged;
  const Wanted wanted = wanted_part(request, file->size(), file->etag());
  if (wanted.what == Wanted::What::nothing) return no_such_part(file->size());
  const bool whole = wanted.what == Wanted::What::whole;
  const ByteRange part = whole ? ByteRange{0, file->size()} : wanted.part;
  if (!whole) {
    response.status = 206;
    response.set("Content-Range", content_range(part, file->size()));
  }
  if (request.method == "HEAD" || part.size > kAtOnce_bytes) response.length = part.size;
  if (request.method == "HEAD") return response;
  if (part.size <= kAtOnce_bytes) {
    try {
      response.body = file->read(part.first, static_cast<std::size_t>(part.size));
    } catch (const ArchiveDamaged& damaged) {  // who asks again finds another
      log_warning("dataset " + route.id + ": " + damaged.what() + "; it is made anew");
      return still_made();
    }
    return response;
  }
  response.next_piece = [pieces = std::make_shared<Pieces>(file, part)] { return pieces->next(); };
  return response;
}

}  // namespace

Response archive(Service& service, const Request& request, const Dataset& dataset, const Route& route) {
  const auto face = face_asked(request);
  if (!face) return problem_response(face.problem());
  if (auto later = route.version.empty() ? wait_for_all(service, request, dataset) : std::nullopt) return std::move(*later);
  const Opened opened = open_published(service, dataset, route);
  if (!opened.terrain) return opened.refusal;
  const ArchiveOrder order{dataset.id, version_of(opened.terrain->manifest()), *face, opened.terrain};
  const auto file = service.archive_files().find(order, request.wait_ends ? Asks::again : Asks::first);
  if (!file) return archive_refusal(service, dataset.id, file.problem());
  if (*file) return answer_file(request, *file, route);
  const MayWait wait = may_wait_for_whole(service.settings().serve.limits, request);
  const Token waiting = wait.longest.count() > 0 ? service.wait_token() : nullptr;
  if (!waiting) return still_made();
  const auto end = request.wait_ends.value_or(std::chrono::steady_clock::now() + wait.longest);
  Response response;
  response.later = [&service, order = ArchiveOrder{order.id, order.version, order.face, nullptr}, waiting, wait,
                    end](Patience patience) -> std::optional<Response> {
    const bool awaited = service.archive_files().is_awaited(order);
    const bool over = patience == Patience::none || service.stopping() || std::chrono::steady_clock::now() >= end;
    if (awaited && !over) return std::nullopt;
    Response come;
    if (awaited) {
      come = still_made();
    } else {
      come.anew = true;  // the dataset may have been hidden meanwhile, or have another version
      come.wait_ends = end;
    }
    if (wait.preferred) come.set("Preference-Applied", "wait=" + std::to_string(wait.longest.count()));
    return come;
  };
  return response;
}

}  // namespace cordillera::server
