// The entries of the option table that a service has, its limits among them. Help and accepted values are written once, here.
#include <algorithm>

#include "proto/letters.h"
#include "proto/parts.h"
#include "server/access/client_address.h"
#include "server/http/dataset_id.h"
#include "server/options/options.h"

namespace cordillera::server {
namespace {

Complaint apply_listen(std::string_view text, Settings& settings) {
  const auto colon = text.rfind(':');
  std::uint32_t port = 0;
  if (colon == std::string_view::npos || colon == 0) return "no host before a port";
  if (auto complaint = read_whole(text.substr(colon + 1), {0, 65535}, &port)) return "port " + *complaint;
  settings.serve.listen = std::string(text);
  return std::nullopt;
}

template <std::string ServeSettings::*field>
Complaint apply_path(std::string_view text, Settings& settings) {
  if (text.empty()) return "empty";
  settings.serve.*field = std::string(text);
  return std::nullopt;
}

/// A list separated by commas. take: of one of them, what is wrong with it.
template <class Take>
Complaint each_of_list(std::string_view text, const Take& take) {
  return proto::each_part(text, ',', [&](std::string_view one) { return take(std::string(one)); });
}

Complaint apply_proxies(std::string_view text, Settings& settings) {
  std::vector<std::string> addresses;
  const Complaint complaint = each_of_list(text, [&](const std::string& one) -> Complaint {
    const auto address = access::plain_address(one);
    if (!address) return one + " is no address";
    addresses.push_back(*address);
    return std::nullopt;
  });
  if (!complaint) settings.serve.trusted_proxies = std::move(addresses);
  return complaint;
}

/// NAME=PATH, separated by commas.
Complaint apply_mounts(std::string_view text, Settings& settings) {
  std::vector<Mount> mounts;
  const Complaint complaint = each_of_list(text, [&](const std::string& one) -> Complaint {
    const std::size_t sign = one.find('=');
    if (sign == one.npos || sign + 1 == one.size()) return one + " is no NAME=PATH";
    const Mount mount{one.substr(0, sign), one.substr(sign + 1)};
    if (!is_id(mount.name)) return "'" + mount.name + "' cannot stand in an address";
    const auto same = [&](const Mount& other) { return other.name == mount.name; };
    if (std::any_of(mounts.begin(), mounts.end(), same)) return mount.name + " is named twice";
    mounts.push_back(mount);
    return std::nullopt;
  });
  if (!complaint) settings.serve.mounts = std::move(mounts);
  return complaint;
}

/// Beginnings of addresses, separated by commas. One that ends within a host's name would let others in.
Complaint apply_source_allow(std::string_view text, Settings& settings) {
  std::vector<std::string> prefixes;
  const Complaint complaint = each_of_list(text, [&](const std::string& one) -> Complaint {
    const std::size_t slashes = one.find("://");
    if (slashes == one.npos) return one + " names no scheme such as https://";
    const std::string scheme = proto::lower(one.substr(0, slashes));
    if (scheme != "http" && scheme != "https" && scheme != "s3")
      return one.substr(0, slashes + 3) + " is no scheme of addresses that are fetched";
    const std::size_t path = one.find('/', slashes + 3);
    if (path == one.npos) return one + " has no / behind its host or bucket";
    // No address that begins so is ever fetched. The beginnings are told to whoever names another address.
    if (one.substr(0, path).find('@') != one.npos)
      return one.substr(0, slashes + 3) + "… has a user's name in front of its host: addresses with one are not fetched";
    if (one.find("/./") != one.npos || one.find("/../") != one.npos)
      return one + " has a . or .. in its path, which no address that is fetched has";
    prefixes.push_back(one);
    return std::nullopt;
  });
  if (!complaint) settings.serve.source_allow = std::move(prefixes);
  return complaint;
}

/// value: what stands for it in help.
LimitOption limit(const char* name, const char* value, const char* help, WholeRange range, std::uint32_t Limits::*field,
                  const char* unit) {
  const auto place = [field](Settings& settings) -> std::uint32_t& { return settings.serve.limits.*field; };
  return {whole_number<Settings>(name, value, help, range, place), field, unit};
}

OptionSpec number(const char* name, const char* value, const char* help, WholeRange range, std::uint32_t ServeSettings::*field) {
  const auto place = [field](Settings& settings) -> std::uint32_t& { return settings.serve.*field; };
  return whole_number<Settings>(name, value, help, range, place);
}

std::vector<OptionSpec> make_serve_options() {
  return {
      {"listen", "HOST:PORT", "where to listen; port 0: any free one", "an address and a port, such as 127.0.0.1:8080",
       apply_listen},
      {"data", "DIR", "folder that holds everything the service keeps", "a folder that can be written",
       apply_path<&ServeSettings::data>},
      {"web", "DIR", "folder of the viewer page; default: the one built with the program", "a folder",
       apply_path<&ServeSettings::web>},
      {"geoids", "DIRS", "folders of geoid grids that requests may name as vertical_datum", "folders, separated by colons",
       apply_path<&ServeSettings::geoids>},
      number("jobs", "N", "builds that run at the same time", {1, 64}, &ServeSettings::jobs),
      {"log-level", "LEVEL", "what is logged to stderr", "debug, info, warn or error",
       [](std::string_view text, Settings& settings) {
         return read_choice(text, {"debug", "info", "warn", "error"}, &settings.serve.log_level);
       }},
      {"log-format", "FORMAT", "how it is logged: for people, or a JSON object a line", "text or json",
       [](std::string_view text, Settings& settings) {
         return read_choice(text, {"text", "json"}, &settings.serve.log_format);
       }},
      {"tokens", "FILE", "who may write: lines of `cordillera token new`; looked at again when it has changed", "a file",
       apply_path<&ServeSettings::tokens>},
      {"token-lines", "LINES", "such lines themselves, for containers that have no file", "lines, separated by semicolons",
       apply_path<&ServeSettings::token_lines>},
      {"insecure-writes", "", "without tokens, let everybody who reaches the port write", "1 or 0",
       [](std::string_view text, Settings& settings) { return read_switch(text, &settings.serve.insecure_writes); }},
      {"trusted-proxies", "ADDRESSES", "proxies whose X-Forwarded-For is believed", "addresses, separated by commas",
       apply_proxies},
      {"mount", "NAME=PATH,…",
       "datasets that were published elsewhere, to be served from there: a .sqlite file, or a folder that build wrote",
       "names of small letters, digits and dashes, each with a path: dem=/srv/dem.sqlite,europe=/vsis3/bucket/europe.sqlite",
       apply_mounts},
      {"live", "FOLDER", "every raster in this folder and below it is a dataset: found, changed and gone while the service runs",
       "a folder", apply_path<&ServeSettings::live>},
      number("cache-size", "MIB", "memory for what was read of mounted datasets, MiB", {1, 1u << 20}, &ServeSettings::cache_mib),
      number("keep-versions", "N", "earlier versions that are kept of a dataset whose rasters or words change", {0, 100},
             &ServeSettings::keep_versions),
      {"source-allow", "PREFIXES", "addresses that the service may fetch rasters from (source=); without it none",
       "beginnings of http://, https:// or s3:// addresses with a / behind the host and no user's name, separated by commas",
       apply_source_allow},
      number("live-fresh", "SECONDS",
             "how long a raster that /v1/live has fetched counts as the same before its address is asked again", {0, 86400},
             &ServeSettings::live_fresh_seconds),
      {"live-open", "", "let everybody who may read have rasters fetched by /v1/live, not only who may post", "1 or 0",
       [](std::string_view text, Settings& settings) { return read_switch(text, &settings.serve.live_open); }},
      {"audit-log", "FILE", "where a line is written for every request that writes; default: audit.jsonl in the data folder",
       "a file", apply_path<&ServeSettings::audit_log>},
  };
}

std::vector<LimitOption> make_limits() {
  return {
      limit("body-limit", "MIB", "greatest raster that may be posted, MiB", {1, 1u << 24}, &Limits::body_mib, "MiB"),
      limit("max-megapixels", "N", "most pixels of a posted raster, millions", {1, 68719}, &Limits::megapixels, "million pixels"),
      limit("max-side", "PIXELS", "longest side of a posted raster, pixels", {1, 2147483647}, &Limits::side, "pixels"),
      limit("max-datasets", "N", "datasets that are kept at the same time", {1, 10000000}, &Limits::datasets, "datasets"),
      limit("max-queue", "N", "builds that wait for their turn; further posts are told to come again", {1, 100000},
            &Limits::queue, "builds"),
      limit("max-uploads", "N", "uploads at the same time", {1, 1000}, &Limits::uploads, "uploads"),
      limit("max-client-uploads", "N", "uploads of one token, or of one address without tokens, at the same time", {1, 1000},
            &Limits::client_uploads, "uploads"),
      limit("max-build-time", "SECONDS", "how long one build may take, whatever its raster", {1, 31536000},
            &Limits::build_seconds, "seconds"),
      limit("build-time-base", "SECONDS", "how long the build of a small raster may take; larger ones may take longer",
            {1, 31536000}, &Limits::build_base_seconds, "seconds"),
      limit("build-time-per-mib", "SECONDS", "how much longer a build may take for each MiB of its rasters", {0, 31536000},
            &Limits::build_seconds_per_mib, "seconds per MiB"),
      limit("max-connections", "N", "connections at the same time; beyond them the longest idle one makes room", {16, 100000},
            &Limits::connections, "connections"),
      limit("max-client-connections", "N", "connections of one address at the same time", {1, 100000},
            &Limits::client_connections, "connections"),
      limit("max-client-streams", "N", "event streams and waiting requests of one address at the same time", {1, 512},
            &Limits::client_streams, "clients"),
      limit("max-wait", "SECONDS", "how long a request may wait for a tile that is still to be made; 0: no request waits",
            {0, 600}, &Limits::wait_seconds, "seconds"),
      limit("max-unsent", "MIB", "memory of large answers that clients have yet to read, MiB; what several share counts once",
            {1, 1u << 20}, &Limits::unsent_mib, "MiB"),
      limit("max-client-unsent", "MIB", "the same of one address", {1, 1u << 20}, &Limits::client_unsent_mib, "MiB"),
      limit("min-rate", "BYTES",
            "bytes a second that a client must send or read on average, once it has kept the server waiting for 10 s, and a host "
            "that a raster is fetched from likewise",
            {1, 1000000000}, &Limits::min_rate, "bytes per second"),
      limit("answer-timeout", "SECONDS",
            "how long a client may keep the server waiting while it reads an answer: a large one has to be read faster than "
            "min-rate",
            {11, 86400}, &Limits::answer_seconds, "seconds"),
      limit("head-timeout", "SECONDS", "how long the head of a request may take", {1, 3600}, &Limits::head_seconds, "seconds"),
      limit("idle-timeout", "SECONDS", "how long a connection may stay without a request", {1, 86400}, &Limits::idle_seconds,
            "seconds"),
      limit("cache-limit", "MIB",
            "disk for what was fetched by /v1/live and for blocks that lazy datasets have made, MiB; what was read longest ago "
            "goes "
            "first; 0: no limit",
            {0, 1u << 30}, &Limits::cache_mib, "MiB"),
      limit("min-disk-free", "PERCENT", "share of the disk that posts and builds leave free", {0, 100}, &Limits::free_percent,
            "percent"),
  };
}

}  // namespace

const std::vector<LimitOption>& limit_options() {
  static const std::vector<LimitOption> table = make_limits();
  return table;
}

const std::vector<OptionSpec>& serve_options() {
  static const std::vector<OptionSpec> table = [] {
    std::vector<OptionSpec> all = make_serve_options();
    for (const LimitOption& limit : limit_options()) all.push_back(limit.option);
    return all;
  }();
  return table;
}

}  // namespace cordillera::server
