#include "server/fetch/range_asks.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <functional>
#include <vector>

#include "raster/disk/write_all.h"
#include "server/fetch/ranged_sources.h"

namespace cordillera::server::updates {
namespace {

// An ask: the number of the file, how many ranges, then each with its first byte and its count. An answer: one byte, when all of
// them are there.
using Number = std::uint64_t;
constexpr char kThere = 'y';
constexpr int kLookEvery_ms = 200;  // at whether it is to end, and whether something is to be noted

/// What a job says, by whoever may have taken it over: it may stop in the middle, or say anything.
class Asks {
 public:
  Asks(int descriptor, std::function<bool()> ended, std::function<void()> idle)
      : descriptor_(descriptor), ended_(std::move(ended)), idle_(std::move(idle)) {}

  /// False: there are no more.
  bool next(Number& file, std::vector<raster::ByteRange>& ranges) {
    Number count = 0;
    if (!take(&file, sizeof file) || !take(&count, sizeof count) || count == 0 || count > raster::kMostRanges) return false;
    ranges.resize(count);
    for (raster::ByteRange& range : ranges)
      if (!take(&range.first, sizeof range.first) || !take(&range.count, sizeof range.count)) return false;
    return true;
  }

 private:
  bool take(void* out, std::size_t count) {
    for (std::size_t done = 0; done < count;) {
      pollfd wait{descriptor_, POLLIN, 0};
      if (ended_()) return false;
      if (poll(&wait, 1, kLookEvery_ms) <= 0) {
        idle_();
        continue;
      }
      const ssize_t now = recv(descriptor_, static_cast<char*>(out) + done, count - done, MSG_DONTWAIT);
      if (now < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (now <= 0) return false;
      done += static_cast<std::size_t>(now);
    }
    return true;
  }

  const int descriptor_;
  const std::function<bool()> ended_;
  const std::function<void()> idle_;
};

}  // namespace

bool may_ask() {
  struct stat found {};
  return fstat(kAskDescriptor, &found) == 0 && S_ISSOCK(found.st_mode);
}

void ask_for(std::size_t file, std::span<const raster::ByteRange> ranges) {
  std::vector<Number> words{file, ranges.size()};
  for (const raster::ByteRange& range : ranges) words.insert(words.end(), {range.first, range.count});
  char answer = 0;
  const bool came =
      raster::write_all(kAskDescriptor, {reinterpret_cast<const char*>(words.data()), words.size() * sizeof(Number)}) &&
      raster::read_all(kAskDescriptor, {&answer, 1}) && answer == kThere;
  if (!came) _exit(1);
}

raster::Descriptor RangeAnswers::open() {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return raster::Descriptor();
  ours_ = raster::Descriptor(ends[0]);
  return raster::Descriptor(ends[1]);
}

void RangeAnswers::begin(RangedSources& sources, const std::atomic<bool>& stop) {
  // Made before, for there may be no memory to make it.
  proto::Problem busy{"service-busy", "the raster cannot be fetched: the service has no memory left", "trying again later", ""};
  thread_ = std::thread([this, &sources, &stop, busy = std::move(busy)]() mutable {
    try {
      answer(sources, stop);
    } catch (const std::exception&) { problem_ = std::move(busy); }
    shutdown(ours_.number(), SHUT_RDWR);  // who waits for an answer gets none
  });
}

void RangeAnswers::answer(RangedSources& sources, const std::atomic<bool>& stop) {
  const auto ended = [&] { return ending_ || stop; };
  Asks asks(ours_.number(), ended, [&] { sources.note(); });
  Number file = 0;
  std::vector<raster::ByteRange> ranges;
  auto noted = std::chrono::steady_clock::now();
  while (asks.next(file, ranges)) {
    const auto there = sources.have(file, ranges, ended);
    if (!there) {
      if (!ended()) problem_ = there.problem();
      return;
    }
    if (send(ours_.number(), &kThere, 1, MSG_NOSIGNAL | MSG_DONTWAIT) != 1) return;
    if (std::chrono::steady_clock::now() - noted < std::chrono::seconds(1)) continue;
    sources.note();
    noted = std::chrono::steady_clock::now();
  }
}

void RangeAnswers::end() {
  ending_ = true;
  if (thread_.joinable()) thread_.join();
  ours_.close();
}

}  // namespace cordillera::server::updates
