#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <thread>

#include "proto/utf8.h"
#include "server/cli/path_kind.h"
#include "server/client/commands.h"
#include "server/client/shelf.h"
#include "server/client/talk.h"
#include "server/client/tiles.h"
#include "server/http/dataset_id.h"
#include "server/options/option_values.h"

namespace cordillera::server::client {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

/// What is to be fetched, and what is done where an address has nothing.
enum class WhenAbsent { problem, counted, next };
struct FetchList {
  std::vector<std::string> addresses;
  WhenAbsent absent = WhenAbsent::problem;
};

struct FetchCounts {
  std::atomic<std::size_t> fetched{0}, provisional{0}, unchanged{0}, absent{0};
  std::atomic<std::uint64_t> bytes{0};
};

// No longer than a connection is patient without a byte.
const std::vector<std::pair<std::string, std::string>> kWaits = {{"Prefer", "wait=30"}};

bool is_provisional(const Answer& answer) { return !answer.header("cordillera-provisional").empty(); }

/// Addresses into files, by several connections.
class Fetching {
 public:
  Fetching(const ServiceAddress& place, const FetchLine& line, FetchList wanted)
      : place_(place), line_(line), wanted_(std::move(wanted)) {}

  /// file: of the only address; empty: each has the path of its address, below the folder.
  proto::Result<void> into(const fs::path& folder, const std::string& file, std::size_t connections) {
    auto shelf = Shelf::open(folder);
    if (!shelf) return shelf.problem();
    std::vector<std::thread> threads;
    for (std::size_t k = 0; k < std::min(connections, wanted_.addresses.size()); ++k)
      threads.emplace_back([&] { work(**shelf, file); });
    for (std::thread& thread : threads) thread.join();
    if (problem_) return *problem_;
    return wanted_.absent == WhenAbsent::next && next_ < kEnd ? nothing() : proto::Result<void>();
  }
  const FetchCounts& counts() const { return counts_; }
  std::string last() const { return last_; }

 private:
  static constexpr std::size_t kEnd = std::size_t{1} << 60;  // far behind the last address

  static Problem nothing() {
    return {"tile-unknown", "the dataset has no tile near its middle", "--bbox and --level", "--middle"};
  }

  void work(Shelf& shelf, const std::string& file) {
    Talk talk(place_, line_.words);
    for (std::size_t k = next_++; k < wanted_.addresses.size(); k = next_++) {
      const std::string& address = wanted_.addresses[k];
      if (const auto one = fetch(talk, shelf, address, file.empty() ? address : file); !one) {
        const std::lock_guard lock(mutex_);
        if (!problem_) problem_ = one.problem();
        next_ = kEnd;
        return;
      }
    }
  }

  /// Whether what is there came with the tag that the service has now.
  static bool unchanged(Talk& talk, const std::string& path, const std::string& tag) {
    return !tag.empty() && talk.patiently({"HEAD", path, {{"If-None-Match", tag}}}).status == 304;
  }

  proto::Result<void> fetch(Talk& talk, Shelf& shelf, const std::string& address, const std::string& name) {
    // A tile that stands in for one that is to be made is no file to keep.
    Call call = {"GET", "/v1/datasets/" + line_.id + "/" + address, kWaits};
    const std::string from = talk.address() + call.path;
    talk.moved();
    if (unchanged(talk, call.path, shelf.tag(name, from))) {
      ++counts_.unchanged;
      return done(address, {});
    }
    while (true) {
      Shelf::Part part(shelf);
      std::uint64_t bytes = 0;
      bool written = true;
      call.take = [&](std::string_view piece) {
        bytes += piece.size();
        return written = part.write(piece);
      };
      const Answer answer = talk.once(call);
      if (!written)
        return Problem{"output-failed", "cannot write into " + line_.output + ": " + strerror(errno),
                       "a folder that can be written, with room", "--output"};
      if (answer.whole(200)) {
        ++counts_.fetched;
        counts_.provisional += is_provisional(answer) ? 1 : 0;
        counts_.bytes += bytes;
        return done(address, part.put(name, from, answer.header("etag")));
      }
      if (answer.whole(404) && wanted_.absent != WhenAbsent::problem && problem_in(object_in(answer)).type == "tile-unknown") {
        ++counts_.absent;
        return {};
      }
      if (!talk.may_help(answer)) return talk.problem_of(answer);
    }
  }

  proto::Result<void> done(const std::string& address, proto::Result<void> put) {
    if (!put || wanted_.absent != WhenAbsent::next) return put;
    const std::lock_guard lock(mutex_);
    last_ = address;
    next_ = kEnd;
    return put;
  }

  const ServiceAddress& place_;
  const FetchLine& line_;
  const FetchList wanted_;
  FetchCounts counts_;
  std::atomic<std::size_t> next_{0};
  std::mutex mutex_;
  std::optional<Problem> problem_;
  std::string last_;
};

proto::Result<Answer> get(const ServiceAddress& place, const FetchLine& line, const std::string& address) {
  Talk talk(place, line.words);
  const Answer answer = talk.patiently({"GET", "/v1/datasets/" + line.id + "/" + address, kWaits});
  return answer.whole(200) ? proto::Result<Answer>(answer) : talk.problem_of(answer);
}

proto::Result<FetchList> wanted_by(const FetchLine& line, const ServiceAddress& place) {
  FetchList wanted;
  for (const std::string& what : line.what) {
    auto address = address_named(what);
    if (!address) return address.problem();
    wanted.addresses.push_back(std::move(*address));
  }
  const bool box = !line.bbox.empty() || !line.level.empty();
  if (int(!line.what.empty()) + int(box) + int(line.middle) > 1)
    return Problem{"usage", "addresses, --bbox with --level, and --middle are three ways to say what to fetch", "one of them",
                   "what"};
  if (!line.what.empty()) return wanted;
  const auto answer = get(place, line, "manifest.json");
  if (!answer) return answer.problem();
  const Json manifest = object_in(*answer);
  const TileWords words = {line.bbox, line.level, line.format};
  const bool layered = line.format == "terrain" && !line.middle;
  const auto layer = layered ? get(place, line, "layer.json") : answer;
  if (!layer) return layer.problem();
  auto addresses = layered       ? addresses_of_layer(manifest, object_in(*layer), words)
                   : line.middle ? addresses_from_the_middle(manifest, line.format)
                                 : addresses_of(manifest, words);
  if (!addresses) return addresses.problem();
  return FetchList{std::move(*addresses), line.middle ? WhenAbsent::next : WhenAbsent::counted};
}

std::optional<Problem> check(const FetchLine& line, std::size_t* connections) {
  if (!is_id(line.id))
    return Problem{"usage", "'" + line.id + "' is no dataset's id", "an id that post printed, or that GET /v1/datasets lists",
                   "id"};
  std::uint32_t number = 0;
  if (const auto wrong = read_whole(line.connections, {1, 32}, &number))
    return wrong_value("--connections", line.connections, *wrong, "1 to 32");
  *connections = line.middle ? 1 : number;  // one after the other: the first that is there counts
  const bool document = line.what.size() == 1 && !line.what.front().ends_with("/");
  if (line.output.empty() && !document)
    return Problem{"usage", "fetch needs to know where to write", "-o FOLDER/; a single address may go to standard output",
                   "--output"};
  return std::nullopt;
}

/// Without what it would obey, but for the ends of lines and tabs.
std::string for_a_terminal(const std::string& text) {
  std::string out;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.find_first_of("\n\t", from), text.size());
    out += proto::one_line(std::string_view(text).substr(from, end - from));
    if (end < text.size()) out += text[end];
    from = end + 1;
  }
  return out;
}

int to_stdout(const ServiceAddress& place, const FetchLine& line) {
  const auto address = address_named(line.what.front());
  if (!address) return tell(address.problem(), line.show);
  const auto answer = get(place, line, *address);
  if (!answer) return tell(answer.problem(), line.show);
  const bool text =
      answer->header("content-type").find("json") != std::string::npos || answer->header("content-type").starts_with("text/");
  if (!text && isatty(STDOUT_FILENO))
    return tell({"usage", "a tile is no text for a terminal", "-o FILE", "--output"}, line.show);
  std::cout << (isatty(STDOUT_FILENO) ? for_a_terminal(answer->body) : answer->body) << std::flush;
  if (is_provisional(*answer) && line.words == Verbosity::all)
    std::cerr << "cordillera: this is provisional: the dataset is not built to its end\n";
  return kDone;
}

void say(const FetchLine& line, const Fetching& fetch) {
  const FetchCounts& counts = fetch.counts();
  if (line.show == Show::json) {
    Json json = {{"fetched", counts.fetched.load()},
                 {"provisional", counts.provisional.load()},
                 {"unchanged", counts.unchanged.load()},
                 {"absent", counts.absent.load()},
                 {"bytes", counts.bytes.load()}};
    if (line.middle) json["address"] = fetch.last();
    std::cout << json.dump() << std::endl;
  } else if (line.middle) {
    std::cout << fetch.last() << std::endl;
  } else if (line.words == Verbosity::all) {
    std::cerr << counts.fetched << " fetched, ";
    if (counts.provisional > 0) std::cerr << counts.provisional << " of them provisional, ";
    std::cerr << counts.bytes << " bytes; " << counts.unchanged << " unchanged; " << counts.absent
              << " addresses without a tile\n";
  }
}

}  // namespace

int fetch_command(const FetchLine& line) {
  std::size_t connections = 0;
  if (const auto wrong = check(line, &connections)) return tell(*wrong, line.show);
  const auto place = find_service(line.place);
  if (!place) return tell(place.problem(), line.show);
  if (line.output.empty()) return to_stdout(*place, line);
  const bool several = line.what.size() != 1 && !line.middle;
  if (several && means_another_file(line.output)) {
    return tell({"usage", "fetch writes many files, and " + line.output + " is named like one",
                 "-o FOLDER (" + line.output + "/ is one)", "--output"},
                line.show);
  }
  auto wanted = wanted_by(line, *place);
  if (!wanted) return tell(wanted.problem(), line.show);
  const fs::path output = line.output;
  std::error_code error;
  const bool one = line.what.size() == 1 || (line.middle && output.has_extension());
  const bool file = one && output.has_filename() && !fs::is_directory(output, error);
  Fetching fetch(*place, line, std::move(*wanted));
  const fs::path folder = !file ? output : output.has_parent_path() ? output.parent_path() : fs::path(".");
  const auto fetched = fetch.into(folder, file ? output.filename().string() : "", connections);
  if (!fetched) return tell(fetched.problem(), line.show);
  say(line, fetch);
  return kDone;
}

}  // namespace cordillera::server::client
