#include "server/fetch/fetch.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>

#include "pipeline/build/build.h"
#include "raster/disk/descriptor.h"
#include "raster/disk/write_all.h"
#include "raster/storage/storage.h"
#include "server/datasets/upload.h"
#include "server/fetch/addresses.h"
#include "server/fetch/http_get.h"
#include "server/limits/space.h"

namespace cordillera::server::updates {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr std::uint64_t kPiece = std::uint64_t{16} << 20;  // of object storage
using Clock = std::chrono::steady_clock;

struct FetchBounds {
  const ServeSettings& settings;
  Clock::duration grace;  ///< before a host has to keep up
};

enum class WantedRaster { whole, beginning };

struct FetchOrder {
  const std::string& address;
  const fs::path& file;
  WantedRaster wanted;
};

/// Takes what comes, within what the operator lets a raster have.
class Sink {
 public:
  /// address: for who is told that it is too slow.
  Sink(const FetchBounds& bounds, limits::Space& space, const std::string& address, const fs::path& file,
       const std::atomic<bool>& stop)
      : settings_(bounds.settings),
        grace_(bounds.grace),
        address_(address),
        claim_(space.claim(0, &full_)),
        stop_(stop),
        end_(Clock::now() + std::chrono::seconds(settings_.limits.build_seconds)),
        file_(open(file.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0640)) {}

  /// False: no more; problem() says why.
  bool put(const char* bytes, std::size_t count) {
    const bool taken = take(bytes, count);
    taken_ = Clock::now();
    return taken;
  }
  bool stopped() const { return stop_; }
  bool synced() const { return file_.is_open() && fsync(file_.number()) == 0; }
  std::uint64_t size() const { return size_; }
  const std::string& head() const { return head_; }  ///< its first bytes
  /// What came goes.
  bool begin_anew() {
    size_ = 0;
    waited_ = {};
    taken_.reset();
    head_.clear();
    if (ftruncate(file_.number(), 0) == 0 && lseek(file_.number(), 0, SEEK_SET) == 0) return true;
    return fail({"storage-full", "the raster cannot be written to disk: " + std::string(strerror(errno)), "", ""});
  }
  const std::optional<Problem>& problem() const { return problem_; }

 private:
  /// What comes more slowly would hold the place of other builds. Only time spent waiting for the host counts, from its first
  /// bytes on.
  bool is_too_slow() const {
    return waited_ > grace_ &&
           static_cast<double>(size_) < std::chrono::duration<double>(waited_).count() * settings_.limits.min_rate;
  }
  bool take(const char* bytes, std::size_t count) {
    const auto now = Clock::now();
    if (taken_) waited_ += now - *taken_;
    size_ += count;
    if (stop_) return fail(pipeline::kCancelled);
    if (size_ > std::uint64_t{settings_.limits.body_mib} << 20) {
      return fail({"body-too-large", "the raster is larger than this service takes",
                   "at most " + std::to_string(settings_.limits.body_mib) + " MiB", "source"});
    }
    if (now > end_)
      return fail({"build-time-limit", "fetching took longer than a build may", "a nearer or a smaller raster", "source"});
    if (is_too_slow())
      return fail(unreachable(address_, "it sends less than " + std::to_string(settings_.limits.min_rate) + " bytes a second"));
    if (claim_) full_ = claim_->next(count);
    if (!full_.empty()) return fail({"storage-full", full_, "trying again when there is room", ""});
    head_.append(bytes, std::min(count, kHead - std::min(kHead, head_.size())));
    if (raster::write_all(file_.number(), {bytes, count})) return true;
    return fail({"storage-full", "the raster cannot be written to disk: " + std::string(strerror(errno)), "", ""});
  }
  bool fail(Problem problem) {
    problem_ = std::move(problem);
    return false;
  }
  static constexpr std::size_t kHead = 16;
  const ServeSettings& settings_;
  const Clock::duration grace_;
  const std::string& address_;
  Clock::duration waited_{};
  std::optional<Clock::time_point> taken_;  ///< when the last bytes were
  std::string head_;
  std::string full_;  ///< why there is no room; before claim_, which may fill it
  const std::unique_ptr<limits::Space::Claim> claim_;
  const std::atomic<bool>& stop_;
  const Clock::time_point end_;
  raster::Descriptor file_;
  std::uint64_t size_ = 0;
  std::optional<Problem> problem_;
};

/// A tag that is longer than any server makes it is of no use.
Print print_of(const Got& got) {
  constexpr std::size_t kLongest = 1024;
  return {got.etag.size() <= kLongest ? got.etag : "", got.modified.size() <= kLongest ? got.modified : "", got.length};
}

/// What a request for the beginning came to.
struct Begun {
  Got got;
  bool part = false;  ///< the beginning came, and not the whole
};

/// Asks for the beginning alone; a host that sends no parts sends the whole.
Begun ask_for_beginning(const std::string& address, Sink& sink) {
  Begun begun;
  Terms terms;
  terms.stopped = [&sink] { return sink.stopped(); };
  terms.range = "bytes=0-" + std::to_string(kRangeBlock_bytes - 1);
  terms.wanted = [&](const Got& head) {
    return (begun.part = can_be_ranged(head)) || (head.status == 200 && head.range.empty());
  };
  begun.got = http_get(
      address,
      [&](std::string_view piece) {
        return (!begun.part || sink.size() + piece.size() <= kRangeBlock_bytes) && sink.put(piece.data(), piece.size());
      },
      terms);
  return begun;
}

Got get_whole(const std::string& address, Sink& sink) {
  Terms terms;
  terms.stopped = [&sink] { return sink.stopped(); };
  return http_get(
      address, [&](std::string_view piece) { return sink.put(piece.data(), piece.size()); }, terms);
}

/// Of a raster whose beginning came; nullopt: it is to be fetched as a whole.
std::optional<Print> beginning_of(const Got& got, const Sink& sink) {
  const auto range = read_content_range(got.range);
  Print print = print_of(got);
  if (!got.trouble.empty() || !range || sink.size() != range->count || (print.etag.empty() && print.modified.empty()))
    return std::nullopt;
  if (!begins_as_tiff(sink.head())) return std::nullopt;
  print.bytes = range->total;
  print.ranged = range->total > range->count;
  return print;
}

proto::Result<Print> fetch_http(const ServeSettings& settings, std::string address, Sink& sink, WantedRaster wanted) {
  for (int redirects = 0; redirects <= kMostRedirects; ++redirects) {
    Begun begun;
    if (wanted == WantedRaster::beginning)
      begun = ask_for_beginning(address, sink);
    else
      begun.got = get_whole(address, sink);
    const Got& got = begun.got;
    if (sink.problem()) return *sink.problem();
    if (sink.stopped()) return pipeline::kCancelled;
    const bool no_part = got.status == 206 || got.status == 416 || (got.status == 200 && !got.range.empty());
    if (wanted == WantedRaster::beginning && no_part) {
      const auto print = begun.part ? beginning_of(got, sink) : std::nullopt;
      if (print) return *print;
      wanted = WantedRaster::whole;
      if (!sink.begin_anew()) return *sink.problem();
      --redirects;
      continue;
    }
    if (got.status == 200 && got.trouble.empty()) return print_of(got);
    if (got.status == 200) return unreachable(address, "it broke off after " + std::to_string(sink.size()) + " bytes");
    if (got.status == 0) return unreachable(address, got.trouble);
    if (got.status / 100 != 3 || got.location.empty()) return unreachable(address, "it answers " + std::to_string(got.status));
    auto next = led_to(settings, address, got.location);
    if (!next) return next.problem();
    address = std::move(*next);
  }
  return unreachable(address, "it leads on and on");
}

/// As GDAL reads it: where the storage signs no address, or what is signed is not answered, such as by a bucket of another
/// region.
proto::Result<Print> copy_object(const std::string& address, Sink& sink) {
  const std::string path = object_path(address);
  const auto size = raster::size_of(path);
  if (!size) return unreachable(address, "there is no such object, or it may not be read");
  for (std::uint64_t at = 0; at < *size;) {
    const auto piece = raster::read_range(path, at, std::min(kPiece, *size - at));
    if (!piece || !*piece || (*piece)->empty())
      return unreachable(address, "it broke off after " + std::to_string(at) + " bytes");
    if (!sink.put((*piece)->data(), (*piece)->size())) return *sink.problem();
    at += (*piece)->size();
  }
  return Print();
}

proto::Result<Print> fetch_object(const ServeSettings& settings, const std::string& address, Sink& sink, WantedRaster wanted) {
  if (const auto signed_one = http_address(address)) {
    auto fetched = fetch_http(settings, *signed_one, sink, wanted);
    if (fetched) return fetched;
    if (sink.problem()) return *sink.problem();
    if (sink.stopped()) return pipeline::kCancelled;
    if (!sink.begin_anew()) return *sink.problem();
  }
  return copy_object(address, sink);
}

proto::Result<Print> fetch_into(const FetchBounds& bounds, limits::Space& space, const FetchOrder& order,
                                const std::atomic<bool>& stop) {
  const auto& [address, file, wanted] = order;
  const ServeSettings& settings = bounds.settings;
  if (const auto allowed = check_address(settings, address); !allowed) return allowed.problem();  // it may have been taken back
  const fs::path part = file.string() + ".part";
  std::error_code error;
  Print print;
  {
    Sink sink(bounds, space, address, part, stop);
    auto fetched =
        is_object(address) ? fetch_object(settings, address, sink, wanted) : fetch_http(settings, address, sink, wanted);
    if (fetched && sink.size() == 0) fetched = unreachable(address, "it is empty");
    if (fetched && !sink.synced())
      fetched = Problem{"storage-full", "the raster cannot be written to disk: " + std::string(strerror(errno)), "", ""};
    if (fetched && fetched->ranged) {
      if (auto begun = begin_ranged(part, sink.size(), fetched->bytes); !begun) fetched = begun.problem();
    }
    if (!fetched) {
      for (const fs::path& left : {part, map_of(part)}) fs::remove(left, error);
      return fetched;
    }
    print = std::move(*fetched);
  }
  if (print.ranged) fs::rename(map_of(part), map_of(file), error);
  if (!error && raster::put_in_place(part, file)) return print;
  const std::string why = error ? error.message() : strerror(errno);
  return Problem{"storage-full", "the raster cannot be put into its place: " + why, "", ""};
}

Still compared(const Print& now, const Print& before) {
  if (!now.etag.empty() && !before.etag.empty()) return now.etag == before.etag ? Still::same : Still::changed;
  const bool other_date = now.modified != before.modified,
             other_size = now.bytes != before.bytes && now.bytes > 0 && before.bytes > 0;
  return other_date || other_size ? Still::changed : Still::same;
}

}  // namespace

Fetch fetcher(const ServeSettings& settings, limits::Space& space, std::chrono::milliseconds grace) {
  const auto into = [settings, &space, grace](WantedRaster wanted) -> Fetch::Into {
    return [settings, &space, grace, wanted](const std::string& address, const fs::path& file, const std::atomic<bool>& stop) {
      return fetch_into({settings, grace}, space, {address, file, wanted}, stop);
    };
  };
  const auto rest = [settings, &space](RangedSource::Place place, HttpTalk& talk) {
    return RangedSource::open(settings, space, talk, std::move(place));
  };
  const auto allowed = [settings](const std::string& address) { return check_address(settings, address); };
  return {into(WantedRaster::whole), into(WantedRaster::beginning), rest, allowed};
}

Ask asker(const ServeSettings& settings) {
  return [settings](std::string address, const Print& before, const std::function<bool()>& stopped) {
    constexpr std::chrono::seconds kPatience{5};
    const bool object = is_object(address);
    for (int redirects = 0; redirects <= kMostRedirects; ++redirects) {
      if (!check_address(settings, address)) return Still::gone;
      if (object && before.etag.empty()) return Still::unknown;  // it was copied
      const auto asked = http_address(address);
      if (!asked) return Still::unknown;
      const Terms terms{.etag = before.etag, .patience = kPatience, .stopped = stopped};
      const Got got = http_get(
          *asked, [](std::string_view) { return false; }, terms);
      if (got.status == 304) return Still::same;
      if (got.status == 200) return compared(print_of(got), before);
      if (got.status == 404 || got.status == 410) return Still::gone;
      // Of an object they may mean that the service's own key is not good any more.
      if (got.status == 401 || got.status == 403) return object ? Still::unknown : Still::gone;
      if (got.status / 100 != 3 || got.location.empty() || object) return Still::unknown;
      address = resolved(address, got.location);
    }
    return Still::unknown;
  };
}

}  // namespace cordillera::server::updates
