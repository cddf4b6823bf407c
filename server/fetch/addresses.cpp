#include "server/fetch/addresses.h"

#include <algorithm>

#include "proto/letters.h"
#include "proto/utf8.h"
#include "raster/storage/storage.h"
#include "server/http/percent.h"
#include "server/options/option_values.h"

namespace cordillera::server::updates {
namespace {

constexpr std::size_t kMostOfAddress = 300;  // bytes, in a message

using proto::Problem;

std::string before_query(const std::string& address) { return address.substr(0, address.find_first_of("?#")); }

bool has_prefix(const ServeSettings& settings, const std::string& address) {
  return std::any_of(settings.source_allow.begin(), settings.source_allow.end(),
                     [&](const std::string& prefix) { return address.starts_with(prefix); });
}

/// "." or "..", also with parameters or blanks behind: some servers take "..;x" for "..".
bool has_dots(const std::string& path) {
  for (std::size_t from = 0; from <= path.size();) {
    const std::size_t end = std::min(path.find('/', from), path.size());
    std::string name = path.substr(from, std::min(path.find_first_of(";?#", from), end) - from);
    while (name.ends_with("%20")) name.resize(name.size() - 3);
    if (name == "." || name == "..") return true;
    from = end + 1;
  }
  return false;
}

bool is_control(char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; }

/// "%252e" to "%2e", however often that was done: a server behind another decodes once more.
std::string escaped_once(std::string path) {
  for (std::size_t at = path.find("%25"); at != path.npos; at = path.find("%25", at)) {
    if (escape_at("%" + path.substr(at + 3, 2), 0))
      path.erase(at + 1, 2);
    else
      at += 3;
  }
  return path;
}

/// An escape that means what ends a name or a text, or makes dots of it.
bool hides_something(const std::string& path) {
  for (std::size_t at = 0; at < path.size(); ++at) {
    const auto byte = escape_at(path, at);
    if (byte && (is_control(*byte) || std::string_view("./\\;").find(*byte) != std::string_view::npos)) return true;
  }
  return false;
}

/// Whether its path could lead out of a prefix, or two programs could read it in two ways. What is no text would be written down
/// without the bytes that are wrong: another address. What follows the path leads nowhere, and a signature may hold %2F.
bool is_crooked(const std::string& address) {
  if (!is_utf8(address) || proto::has_control(address)) return true;
  if (std::any_of(address.begin(), address.end(), [](char c) { return c == ' ' || c == '\\' || c == '@'; })) return true;
  const std::string path = escaped_once(is_object(address) ? address : before_query(address));  // a key may have any character
  const std::size_t host = path.find("://") + 3;
  if (path.find('/', host) == std::string::npos)
    return true;  // a query right after the host: some would take it for a part of the name
  return hides_something(path) || has_dots(path.substr(host));
}

/// "https:" of "https://host", empty of what has no scheme (RFC 3986, 3.1).
std::string scheme_of(const std::string& reference) {
  const std::size_t colon = reference.find(':');
  if (colon == std::string::npos || colon == 0 || !proto::is_letter(reference.front())) return "";
  const bool plain = std::all_of(reference.begin(), reference.begin() + static_cast<std::ptrdiff_t>(colon),
                                 [](char c) { return proto::is_letter_or_digit(c, "+-."); });
  return plain ? reference.substr(0, colon + 1) : "";
}

/// Where a reference leads, with its dots still in it.
std::string joined(const std::string& address, const std::string& location) {
  if (!scheme_of(location).empty()) return location;
  if (location.starts_with("//")) return scheme_of(address) + location;
  const auto [host, query] = host_and_target(address);
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
    if (step != "/.." && step != "/.")
      out += step;
    else if (last)
      out += '/';
    from = end;
  }
  return out;
}

/// The scheme in small letters, and the path without "." and "..".
std::string without_dots(const std::string& address) {
  const std::string scheme = proto::lower(scheme_of(address));
  const std::string rest = address.substr(scheme.size()), plain = before_query(rest);
  const std::size_t path = rest.starts_with("//") ? plain.find('/', 2) : std::string::npos;
  if (path == std::string::npos) return scheme + rest;
  return scheme + plain.substr(0, path) + climbed(plain.substr(path)) + rest.substr(plain.size());
}

/// Some servers send blanks and letters beyond ASCII as they are. Nothing else is touched.
std::string with_escapes(const std::string& location) {
  return proto::percent_escaped(location, [](char c) { return c != ' ' && static_cast<unsigned char>(c) < 0x80; });
}

}  // namespace

std::pair<std::string, std::string> host_and_target(const std::string& address) {
  const std::size_t path = address.find_first_of("/?#", address.find("://") + 3);
  if (path == std::string::npos || address[path] == '#') return {address.substr(0, path), "/"};
  const std::string target = address.substr(path, address.find('#', path) - path);
  return {address.substr(0, path), target.starts_with('/') ? target : "/" + target};
}

std::string without_query(const std::string& address) {
  std::string shown;
  bool parameter = false;
  for (const char c : before_query(address)) {
    parameter = c == ';' || (parameter && c != '/');
    if (!parameter) shown += c;
  }
  return shown;
}

std::string resolved(const std::string& address, const std::string& location) {
  return without_dots(joined(address, with_escapes(location)));
}

std::string object_path(const std::string& address) { return "/vsis3/" + address.substr(std::string_view("s3://").size()); }

std::optional<std::string> http_address(const std::string& address) {
  return is_object(address) ? raster::signed_address(object_path(address)) : address;
}

proto::Result<void> check_address(const ServeSettings& settings, const std::string& address) {
  // What the operator allows is not told: the problem stands with the dataset, for whoever may read it.
  const auto forbidden = [](const std::string& why) {
    return Problem{"option-forbidden", why, "a raster in the body, or an address that the operator allows", "source"};
  };
  if (settings.source_allow.empty())
    return forbidden("this service fetches no rasters; cordillera serve --source-allow says from where one may");
  const bool known = address.starts_with("https://") || address.starts_with("http://") || is_object(address);
  const std::string shown = proto::shown_text(without_query(address), kMostOfAddress);
  if (!known || !has_prefix(settings, address)) return forbidden("the operator does not allow fetching from " + shown);
  if (is_crooked(address))
    return forbidden(shown +
                     " is not fetched as it is written: a blank is %20 and an @ is %40, and a path has no \\, .., %2E or %2F");
  return {};
}

proto::Result<std::string> led_to(const ServeSettings& settings, const std::string& address, const std::string& location) {
  std::string next = resolved(address, location);
  if (const auto allowed = check_address(settings, next); !allowed) {
    Problem refused = allowed.problem();  // where it leads is the host's matter, and may have a secret
    refused.detail = proto::shown_text(without_query(address), kMostOfAddress) + " leads to an address that is not allowed";
    return refused;
  }
  if (is_object(next)) return unreachable(address, "it leads to what is neither http nor https");
  return next;
}

Problem unreachable(const std::string& address, const std::string& why) {
  return {"source-unreachable", proto::shown_text(without_query(address), kMostOfAddress) + " cannot be fetched: " + why,
          "an address that answers with the raster", "source"};
}

}  // namespace cordillera::server::updates
