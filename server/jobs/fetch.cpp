#include "server/jobs/fetch.h"

#include <fcntl.h>
#include <httplib.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>

#include "raster/storage.h"
#include "server/limits/space.h"
#include "server/options/option_values.h"
#include "server/datasets/upload.h"

namespace cordillera::server::updates {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr int kMostRedirects = 5;
constexpr auto kPatience = std::chrono::seconds(60);       // without a byte
constexpr std::uint64_t kPiece = std::uint64_t{16} << 20;  // of object storage

Problem unreachable(const std::string& address, const std::string& why) {
  return {"source-unreachable", without_query(address) + " cannot be fetched: " + why, "an address that answers with the raster", "source"};
}

std::string before_query(const std::string& address) { return address.substr(0, address.find_first_of("?#")); }

/// Takes what comes, within what the operator lets a raster have.
class Sink {
 public:
  Sink(const ServeSettings& settings, limits::Space& space, const fs::path& file, const std::atomic<bool>& stop)
      : settings_(settings),
        claim_(space.claim(0, &full_)),
        stop_(stop),
        end_(std::chrono::steady_clock::now() + std::chrono::seconds(settings.limits.build_seconds)),
        descriptor_(open(file.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0640)) {}
  ~Sink() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;

  /// False: no more; problem() says why.
  bool put(const char* bytes, std::size_t count) {
    size_ += count;
    if (stop_) return fail({"cancelled", "the build was cancelled", "", ""});
    if (size_ > std::uint64_t{settings_.limits.body_mib} << 20) {
      return fail({"body-too-large", "the raster is larger than this service takes",
                   "at most " + std::to_string(settings_.limits.body_mib) + " MiB", "source"});
    }
    if (std::chrono::steady_clock::now() > end_)
      return fail({"build-time-limit", "fetching took longer than a build may", "a nearer or a smaller raster", "source"});
    if (claim_) full_ = claim_->next(count);
    if (!full_.empty()) return fail({"storage-full", full_, "trying again when there is room", ""});
    while (count > 0) {
      const ssize_t written = write(descriptor_, bytes, count);
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0)
        return fail({"storage-full", "the raster cannot be written to disk: " + std::string(strerror(errno)), "", ""});
      bytes += written;
      count -= static_cast<std::size_t>(written);
    }
    return true;
  }
  bool synced() const { return descriptor_ >= 0 && fsync(descriptor_) == 0; }
  std::uint64_t size() const { return size_; }
  const std::optional<Problem>& problem() const { return problem_; }

 private:
  bool fail(Problem problem) {
    problem_ = std::move(problem);
    return false;
  }
  const ServeSettings& settings_;
  std::string full_;  ///< why there is no room; before claim_, which may fill it
  const std::unique_ptr<limits::Space::Claim> claim_;
  const std::atomic<bool>& stop_;
  const std::chrono::steady_clock::time_point end_;
  int descriptor_;
  std::uint64_t size_ = 0;
  std::optional<Problem> problem_;
};

/// "https://host:1/a?b" -> "https://host:1" and "/a?b".
std::pair<std::string, std::string> split(const std::string& address) {
  const std::size_t path = address.find('/', address.find("://") + 3);
  return {address.substr(0, path), path == std::string::npos ? "/" : address.substr(path, address.find('#', path) - path)};
}

proto::Result<void> fetch_http(const ServeSettings& settings, std::string address, Sink& sink) {
  for (int redirects = 0; redirects <= kMostRedirects; ++redirects) {
    const auto [host, path] = split(address);
    httplib::Client client(host);
    client.set_follow_location(false);  // where to, is looked at first
    client.set_url_encode(false);
    client.set_connection_timeout(kPatience);
    client.set_read_timeout(kPatience);
    int status = 0;
    std::string location;
    const auto head = [&](const httplib::Response& response) {
      status = response.status;
      location = response.get_header_value("Location");
      return status == 200;
    };
    const auto result = client.Get(path, {{"Accept-Encoding", "identity"}}, head,
                                   [&](const char* bytes, std::size_t count) { return sink.put(bytes, count); });
    if (sink.problem()) return *sink.problem();
    if (status == 200)
      return result ? proto::Result<void>()
                    : unreachable(address, "it broke off after " + std::to_string(sink.size()) + " bytes");
    if (status == 0) return unreachable(address, httplib::to_string(result.error()));
    if (status / 100 != 3 || location.empty()) return unreachable(address, "it answers " + std::to_string(status));
    address = resolved(address, location);
    if (const auto allowed = check_address(settings, address); !allowed) return allowed;
  }
  return unreachable(address, "it leads on and on");
}

proto::Result<void> fetch_object(const std::string& address, Sink& sink) {
  const std::string path = "/vsis3/" + address.substr(std::string("s3://").size());
  const auto size = raster::size_of(path);
  if (!size) return unreachable(address, "there is no such object, or it may not be read");
  for (std::uint64_t at = 0; at < *size;) {
    const auto piece = raster::read_range(path, at, std::min(kPiece, *size - at));
    if (!piece || !*piece || (*piece)->empty())
      return unreachable(address, "it broke off after " + std::to_string(at) + " bytes");
    if (!sink.put((*piece)->data(), (*piece)->size())) return *sink.problem();
    at += (*piece)->size();
  }
  return {};
}

bool has_prefix(const ServeSettings& settings, const std::string& address) {
  return std::any_of(settings.source_allow.begin(), settings.source_allow.end(),
                     [&](const std::string& prefix) { return address.starts_with(prefix); });
}

/// "." or "..", also with parameters: some servers take "..;x" for "..".
bool has_dots(const std::string& path) {
  for (std::size_t from = 0; from <= path.size();) {
    const std::size_t end = std::min(path.find('/', from), path.size());
    const std::string name = path.substr(from, std::min(path.find_first_of(";?#", from), end) - from);
    if (name == "." || name == "..") return true;
    from = end + 1;
  }
  return false;
}

/// Whether its path could lead out of a prefix, or two programs could read it in two ways. What is no text would be written down without the
/// bytes that are wrong: another address. What follows the path leads nowhere, and a signature may hold %2F.
bool is_crooked(const std::string& address) {
  if (!is_utf8(address)) return true;
  if (std::any_of(address.begin(), address.end(), [](unsigned char c) { return c <= ' ' || c == 127 || c == '\\' || c == '@'; })) return true;
  std::string path = address.starts_with("s3://") ? address : before_query(address);  // a key may have any character
  std::transform(path.begin(), path.end(), path.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::size_t host = path.find("://") + 3;
  if (path.find('/', host) == std::string::npos) return true;  // a query right after the host: some would take it for a part of the name
  for (const char* hidden : {"%2e", "%2f", "%5c", "%3b"}) {
    if (path.find(hidden) != std::string::npos) return true;
  }
  return has_dots(path.substr(host));
}

/// "https:" of "https://host", empty of what has no scheme (RFC 3986, 3.1).
std::string scheme_of(const std::string& reference) {
  const std::size_t colon = reference.find(':');
  if (colon == std::string::npos || colon == 0 || !std::isalpha(static_cast<unsigned char>(reference.front()))) return "";
  const bool plain = std::all_of(reference.begin(), reference.begin() + static_cast<std::ptrdiff_t>(colon),
                                 [](unsigned char c) { return std::isalnum(c) || c == '+' || c == '-' || c == '.'; });
  return plain ? reference.substr(0, colon + 1) : "";
}

/// Where a reference leads, with its dots still in it.
std::string joined(const std::string& address, const std::string& location) {
  if (!scheme_of(location).empty()) return location;
  if (location.starts_with("//")) return scheme_of(address) + location;
  const auto [host, query] = split(address);
  const std::string path = before_query(query);
  if (location.starts_with("/")) return host + location;
  if (location.starts_with("?")) return host + path + location;
  if (location.empty() || location.starts_with("#")) return host + query;
  return host + path.substr(0, path.rfind('/') + 1) + location;
}

/// RFC 3986, 5.2.4, of a path that begins with "/": none leads above it.
std::string climbed(const std::string& path) {
  std::string out;
  for (std::size_t from = 0; from < path.size();) {
    const std::size_t end = std::min(path.find('/', from + 1), path.size());
    const std::string step = path.substr(from, end - from);
    const bool last = end == path.size();
    if (step == "/..") out.resize(std::min(out.rfind('/'), out.size()));
    if (step != "/.." && step != "/.") out += step;
    else if (last) out += '/';
    from = end;
  }
  return out;
}

/// The scheme in small letters, and the path without "." and "..".
std::string without_dots(const std::string& address) {
  std::string scheme = scheme_of(address);
  std::transform(scheme.begin(), scheme.end(), scheme.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::string rest = address.substr(scheme.size()), plain = before_query(rest);
  const std::size_t path = rest.starts_with("//") ? plain.find('/', 2) : std::string::npos;
  if (path == std::string::npos) return scheme + rest;
  return scheme + plain.substr(0, path) + climbed(plain.substr(path)) + rest.substr(plain.size());
}

bool has_escape(const std::string& text) {
  const auto digit = [&](std::size_t k) { return k < text.size() && std::isxdigit(static_cast<unsigned char>(text[k])); };
  for (std::size_t at = text.find('%'); at != std::string::npos; at = text.find('%', at + 1)) {
    if (digit(at + 1) && digit(at + 2)) return true;
  }
  return false;
}

/// httplib hands a Location out without its escapes: those that can be told are put back. One that has escapes is left as it is. Blanks and what
/// is beyond ASCII stand in no address. A plus in a query was most likely one of a signature: as such it would be a blank.
std::string with_escapes(const std::string& location) {
  if (has_escape(location)) return location;
  const std::size_t query = std::min(location.find('?'), location.size());
  std::string out;
  for (std::size_t k = 0; k < location.size(); ++k) {
    const auto c = static_cast<unsigned char>(location[k]);
    const bool escaped = c == ' ' || c == '%' || c >= 0x80 || (c == '+' && k > query);
    constexpr const char* kHex = "0123456789ABCDEF";
    if (escaped) out += {'%', kHex[c >> 4], kHex[c & 15]};
    else out += location[k];
  }
  return out;
}

}  // namespace

std::string without_query(const std::string& address) {
  std::string shown;
  bool parameter = false;
  for (const char c : before_query(address)) {
    parameter = c == ';' || (parameter && c != '/');
    if (!parameter) shown += c;
  }
  return shown;
}

std::string resolved(const std::string& address, const std::string& location) { return without_dots(joined(address, with_escapes(location))); }

proto::Result<void> check_address(const ServeSettings& settings, const std::string& address) {
  std::string accepted = "a raster in the body";
  for (const std::string& prefix : settings.source_allow) accepted += ", or below " + prefix;
  const auto forbidden = [&](const std::string& why) { return Problem{"option-forbidden", why, accepted, "source"}; };
  if (settings.source_allow.empty())
    return forbidden("this service fetches no rasters; cordillera serve --source-allow says from where one may");
  const bool known = address.starts_with("https://") || address.starts_with("http://") || address.starts_with("s3://");
  if (!known || is_crooked(address) || !has_prefix(settings, address))
    return forbidden("the operator does not allow fetching from " + without_query(address).substr(0, 300));
  return {};
}

Fetch fetcher(const ServeSettings& settings, limits::Space& space) {
  return [settings, &space](const std::string& address, const fs::path& file, const std::atomic<bool>& stop) -> proto::Result<void> {
    if (const auto allowed = check_address(settings, address); !allowed) return allowed;  // it may have been taken back
    const fs::path part = file.string() + ".part";
    std::error_code error;
    {
      Sink sink(settings, space, part, stop);
      auto fetched = address.starts_with("s3://") ? fetch_object(address, sink) : fetch_http(settings, address, sink);
      if (fetched && sink.size() == 0) fetched = unreachable(address, "it is empty");
      if (fetched && !sink.synced())
        fetched = Problem{"storage-full", "the raster cannot be written to disk: " + std::string(strerror(errno)), "", ""};
      if (!fetched) {
        fs::remove(part, error);
        return fetched;
      }
    }
    fs::rename(part, file, error);
    if (!error && sync_folder(file.parent_path())) return {};
    return Problem{"storage-full", "the raster cannot be put into its place: " + error.message(), "", ""};
  };
}

}  // namespace cordillera::server::updates
