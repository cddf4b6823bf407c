#include "server/fetch/ranged_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>

#include "pipeline/build/build.h"
#include "proto/numbers.h"
#include "raster/disk/descriptor.h"
#include "raster/disk/write_all.h"
#include "server/fetch/addresses.h"

namespace cordillera::server::updates {
namespace {

namespace fs = std::filesystem;
using proto::Problem;
using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kMostAtOnce = 16;      // blocks that are fetched beyond what was asked for, where it is read on and on
constexpr std::uint64_t kMostOfARequest = 64;  // blocks
constexpr int kTries = 3;
constexpr std::chrono::seconds kPartPatience{10};  // without a byte
constexpr std::chrono::seconds kLongestPart{60};   // for one request of at most 4 MiB, with all its tries
constexpr std::chrono::milliseconds kBetweenTries{200};

std::uint64_t blocks_of(std::uint64_t bytes) { return (bytes + kRangeBlock_bytes - 1) / kRangeBlock_bytes; }

Problem no_room(const std::string& why) { return {"storage-full", why, "trying again when there is room", ""}; }

/// A plain file of this size, by no other name, or none. The job may have put something else there.
raster::Descriptor open_plain(const fs::path& path, std::uint64_t bytes) {
  raster::Descriptor file(open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  struct stat found {};
  const bool plain = file.is_open() && fstat(file.number(), &found) == 0 && S_ISREG(found.st_mode) && found.st_nlink == 1 &&
                     static_cast<std::uint64_t>(found.st_size) == bytes;
  return plain ? std::move(file) : raster::Descriptor();
}

/// nullopt: it does not say. What was asked for with If-Range may come without a date.
std::optional<bool> is_same(const Got& head, const Print& print) {
  if (!head.etag.empty() && !print.etag.empty()) return head.etag == print.etag;
  if (!head.modified.empty() && !print.modified.empty()) return head.modified == print.modified;
  return std::nullopt;
}

bool is_strong(const std::string& etag) { return etag.starts_with('"'); }

}  // namespace

std::optional<ContentRange> read_content_range(const std::string& text) {
  constexpr std::string_view kUnit = "bytes ";
  const std::size_t dash = text.find('-'), slash = text.find('/');
  if (!text.starts_with(kUnit) || dash == text.npos || slash == text.npos || slash < dash) return std::nullopt;
  const auto between = [&](std::size_t from, std::size_t end) {
    return proto::number<std::uint64_t>(std::string_view(text).substr(from, end - from));
  };
  const auto first = between(kUnit.size(), dash), last = between(dash + 1, slash), total = between(slash + 1, text.size());
  if (!first || !last || !total || *last < *first || *last >= *total) return std::nullopt;
  return ContentRange{*first, *last - *first + 1, *total};
}

bool can_be_ranged(const Got& head) {
  const auto range = read_content_range(head.range);
  const bool has_mark = !head.etag.empty() || !head.modified.empty();
  return head.status == 206 && has_mark && range && range->first == 0 && range->total <= kLargestRanged_bytes &&
         range->count == std::min(kRangeBlock_bytes, range->total);
}

bool begins_as_tiff(std::string_view bytes) {
  using namespace std::string_view_literals;
  for (const std::string_view mark : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv})
    if (bytes.starts_with(mark)) return true;
  return false;
}

proto::Result<void> begin_ranged(const fs::path& file, std::uint64_t begun_bytes, std::uint64_t bytes) {
  const bool sized = truncate(file.c_str(), static_cast<off_t>(bytes)) == 0;
  if (!sized && errno == EFBIG)
    return Problem{"body-too-large", "the raster is larger than the service's disk holds in one file", "a smaller raster",
                   "source"};
  std::string map((blocks_of(bytes) + 7) / 8, '\0');
  for (std::uint64_t block = 0; block < blocks_of(begun_bytes); ++block)
    map[block / 8] = static_cast<char>(map[block / 8] | 1 << (block % 8));
  const raster::Descriptor out(open(map_of(file).c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC | O_NOFOLLOW, 0640));
  if (sized && out.is_open() && raster::write_all_at(out.number(), map, 0) && fsync(out.number()) == 0) return {};
  return no_room("the raster cannot be written to disk: " + std::string(strerror(errno)));
}

RangedSource::RangedSource(const ServeSettings& settings, limits::Space& space, HttpTalk& talk, Place place)
    : settings_(settings), place_(std::move(place)), claim_(space.claim(0, &full_)), talk_(talk) {}

RangedSource::~RangedSource() { note(); }

proto::Result<std::unique_ptr<RangedSource>> RangedSource::open(const ServeSettings& settings, limits::Space& space,
                                                                HttpTalk& talk, Place place) {
  std::unique_ptr<RangedSource> source(new RangedSource(settings, space, talk, std::move(place)));
  const std::uint64_t bytes = source->place_.print.bytes, map_bytes = (blocks_of(bytes) + 7) / 8;
  source->file_ = open_plain(source->place_.file, bytes);
  source->map_file_ = open_plain(map_of(source->place_.file), map_bytes);
  if (!source->file_.is_open() || !source->map_file_.is_open()) return source->changed();
  source->map_.resize(map_bytes);
  if (!raster::read_all_at(source->map_file_.number(), source->map_, 0)) return source->changed();
  for (std::uint64_t block = 0; block < blocks_of(bytes); ++block) source->here_ += source->is_here(block) ? 1 : 0;
  return source;
}

Problem RangedSource::changed() const {
  return {"source-replaced", without_query(place_.address) + " has another raster than it had", "trying again", "source"};
}

/// In the order of the file.
std::vector<RangedSource::Run> RangedSource::missing(std::span<const raster::ByteRange> ranges) const {
  std::vector<std::uint64_t> blocks;
  for (const raster::ByteRange& range : ranges) {
    for (std::uint64_t block = range.first / kRangeBlock_bytes; block * kRangeBlock_bytes < range.first + range.count; ++block)
      if (!is_here(block)) blocks.push_back(block);
  }
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  std::vector<Run> runs;
  for (const std::uint64_t block : blocks) {
    if (!runs.empty() && block == runs.back().first + runs.back().count && runs.back().count < kMostOfARequest)
      ++runs.back().count;
    else
      runs.push_back({block, 1});
  }
  return runs;
}

proto::Result<void> RangedSource::have(std::span<const raster::ByteRange> ranges, const std::function<bool()>& stopped,
                                       const std::function<void()>& came) {
  std::uint64_t asked = 0;
  for (const raster::ByteRange& range : ranges) {
    const bool within = range.first <= place_.print.bytes && range.count <= place_.print.bytes - range.first;
    if (!within || range.count > raster::kMostAsked_bytes || (asked += range.count) > raster::kMostAsked_bytes)
      return Problem{"internal", "a job asked for bytes that its raster does not have", "", ""};
  }
  for (Run run : missing(ranges)) {
    // Who reads on gets more at once: tables of places in the file are read so, and each request costs its way there and back.
    if (run.first == last_.first + last_.count) {
      const std::uint64_t most = std::min(2 * last_.count, kMostAtOnce), end = blocks_of(place_.print.bytes);
      while (run.count < most && run.first + run.count < end && !is_here(run.first + run.count)) ++run.count;
    }
    if (auto fetched = fetch(run, stopped); !fetched) return fetched;
    last_ = run;
    came();
  }
  return {};
}

struct RangedSource::Answer {
  enum class Is { whole, changed, late, refused } is = Is::refused;  ///< late: it may be well another time
  std::string bytes, why;
  std::optional<Problem> problem{};
};

/// One request, wherever it leads.
RangedSource::Answer RangedSource::ask(const Run& run, const Terms& terms) {
  using Is = Answer::Is;
  const Print& print = place_.print;
  const std::uint64_t first = run.first * kRangeBlock_bytes, count = std::min(run.count * kRangeBlock_bytes, print.bytes - first);
  bool other = false;
  Answer answer;
  Terms of_part = terms;
  of_part.wanted = [&](const Got& head) {
    const auto range = read_content_range(head.range);
    const auto same = is_same(head, print);
    other = (head.status == 200 && !same.value_or(false)) ||
            (head.status == 206 && (!same.value_or(!of_part.if_range.empty()) || (range && range->total != print.bytes)));
    return head.status == 206 && !other && range && range->first == first && range->count == count &&
           (head.length == 0 || head.length == count);
  };
  // Where it leads is looked at as it leads there, and an object's signed address is that of the operator's own storage.
  if (const auto allowed = check_address(settings_, place_.address); !allowed) return {Is::refused, "", "", allowed.problem()};
  for (int redirects = 0; redirects <= kMostRedirects; ++redirects) {
    answer.bytes.clear();
    const Got got = talk_.get(
        at_, [&](std::string_view piece) { return answer.bytes.append(piece).size() <= count; }, of_part);
    // Also where it answers with all of it, which gave parts before.
    if (other || got.status == 412 || got.status == 416 || got.status == 200) return {Is::changed, "", "", {}};
    if (got.status / 100 == 3 && !got.location.empty()) {
      auto next = led_to(settings_, at_, got.location);
      if (!next) return {Is::refused, "", "", next.problem()};
      at_ = std::move(*next);
      continue;
    }
    if (got.status == 0) return {Is::late, "", got.trouble, {}};
    if (got.status == 429 || got.status / 100 == 5) return {Is::late, "", "it answers " + std::to_string(got.status), {}};
    if (got.status != 206) return {Is::refused, "", "it answers " + std::to_string(got.status), {}};
    if (answer.bytes.size() > count) return {Is::refused, "", "it sends more than was asked for", {}};
    if (!got.trouble.empty() || answer.bytes.size() < count)
      return {Is::late,
              "",
              answer.bytes.empty() ? "it sends another part than was asked for"
                                   : "a part broke off after " + std::to_string(answer.bytes.size()) + " bytes",
              {}};
    answer.is = Is::whole;
    return answer;
  }
  return {Is::refused, "", "it leads on and on", {}};
}

proto::Result<void> RangedSource::fetch(const Run& run, const std::function<bool()>& stopped) {
  const Print& print = place_.print;
  const std::uint64_t most_bytes = std::uint64_t{settings_.limits.body_mib} << 20;
  if ((here_ + run.count) * kRangeBlock_bytes > most_bytes)
    return Problem{"body-too-large", "more of the raster was read than this service takes of one",
                   "at most " + std::to_string(settings_.limits.body_mib) + " MiB", "source"};
  const std::uint64_t first = run.first * kRangeBlock_bytes,
                      end = std::min((run.first + run.count) * kRangeBlock_bytes, print.bytes);
  Terms terms;
  terms.patience = kPartPatience;
  terms.until = Clock::now() + kLongestPart;
  terms.range = "bytes=" + std::to_string(first) + "-" + std::to_string(end - 1);
  terms.if_range = is_strong(print.etag) ? print.etag : print.etag.empty() ? print.modified : "";
  terms.stopped = stopped;
  Answer answer;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    for (auto rest = kBetweenTries * attempt; rest.count() > 0 && !stopped(); rest -= std::chrono::milliseconds(50))
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    if (stopped()) return pipeline::kCancelled;
    // Where it led to, and a signature, may be good for some minutes alone.
    const bool known = !at_.empty() && at_ != place_.address;
    if (at_.empty()) {
      const auto begin = http_address(place_.address);
      if (!begin) return unreachable(place_.address, "its storage signs no address any more");
      at_ = *begin;
    }
    answer = ask(run, terms);
    if (answer.is == Answer::Is::whole) return keep(run, answer.bytes);
    if (answer.is == Answer::Is::changed) return changed();
    at_.clear();
    if (answer.is == Answer::Is::refused && !known) break;
    if (Clock::now() > *terms.until) break;
  }
  if (stopped()) return pipeline::kCancelled;
  if (answer.problem) return *answer.problem;
  return unreachable(place_.address, answer.why);
}

proto::Result<void> RangedSource::keep(const Run& run, const std::string& bytes) {
  if (lost_) return no_room("the raster cannot be written to disk");
  if (claim_) full_ = claim_->next(bytes.size());
  if (!full_.empty()) return no_room(full_);
  if (!raster::write_all_at(file_.number(), bytes, run.first * kRangeBlock_bytes))
    return no_room("the raster cannot be written to disk: " + std::string(strerror(errno)));
  mark(run);
  return {};
}

void RangedSource::mark(const Run& run) {
  for (std::uint64_t block = run.first; block < run.first + run.count; ++block)
    map_[block / 8] = static_cast<char>(map_[block / 8] | 1 << (block % 8));
  here_ += run.count;
  noted_ = false;
}

void RangedSource::note() {
  // What a disk lost once it may call written the next time: then the map stays as it is.
  if (noted_ || lost_ || (lost_ = fdatasync(file_.number()) != 0)) return;
  noted_ = raster::write_all_at(map_file_.number(), map_, 0);
}

}  // namespace cordillera::server::updates
