#include "server/http/form_body.h"

#include <algorithm>

#include "proto/letters.h"

namespace cordillera::server {
namespace {

constexpr std::size_t kMostHead = std::size_t{8} << 10;     // of a part
constexpr std::size_t kMostFields = std::size_t{64} << 10;  // of all together, their names included
constexpr std::size_t kLongestBoundary = 70;                // RFC 2046, 5.1.1

/// The value of a parameter of a header, `; name=value` or `; name="a \"quoted\" one"`; none: it is not there.
std::optional<std::string> parameter(const std::string& header, const std::string& name) {
  bool quoted = false;
  for (std::size_t at = 0; at < header.size(); ++at) {
    if (header[at] == '\\' && quoted) {
      ++at;
      continue;
    }
    if (header[at] == '"') quoted = !quoted;
    if (header[at] != ';' || quoted) continue;
    std::size_t begin = header.find_first_not_of(" \t", at + 1);
    if (begin == header.npos || proto::lower(header.substr(begin, name.size() + 1)) != name + "=") continue;
    begin += name.size() + 1;
    if (begin >= header.size() || header[begin] != '"') {
      const std::string value = header.substr(begin, header.find(';', begin) - begin);
      return value.substr(0, value.find_last_not_of(" \t") + 1);
    }
    std::string value;
    for (++begin; begin < header.size() && header[begin] != '"'; ++begin) {
      // Only of these two: a path of another system has backslashes that mean themselves.
      const bool escape =
          header[begin] == '\\' && begin + 1 < header.size() && (header[begin + 1] == '"' || header[begin + 1] == '\\');
      if (escape) ++begin;
      value += header[begin];
    }
    return value;
  }
  return std::nullopt;
}

/// Of the part's header lines, the one that names it.
std::string disposition(const std::string& head) {
  for (std::size_t at = 0; at < head.size();) {
    const std::size_t end = std::min(head.find("\r\n", at), head.size());
    const std::string line = head.substr(at, end - at);
    if (proto::lower(line).starts_with("content-disposition:")) return line;
    at = end + 2;
  }
  return "";
}

}  // namespace

std::optional<FormReader> FormReader::of(const std::string& content_type) {
  if (!proto::lower(content_type).starts_with("multipart/form-data")) return std::nullopt;
  const auto boundary = parameter(content_type, "boundary");
  if (boundary && boundary->size() > kLongestBoundary) return std::nullopt;
  return FormReader(boundary.value_or(""));
}

bool FormReader::take_delimiter() {
  const std::size_t end = rest_.find("\r\n", 2);
  const bool can_be = rest_.size() < 4 || rest_.compare(2, 2, "--") == 0;
  if (!can_be || (end == rest_.npos ? rest_.size() : end) > 4 + kLongestBoundary || end == 4)
    return fail("its Content-Type has no boundary, and it does not begin with one; clients set that header by themselves");
  if (end == rest_.npos) return false;
  delimiter_ = rest_.substr(0, end);
  return true;
}

bool FormReader::fail(const std::string& why) {
  problem_ = proto::Problem{"form-invalid", "the form cannot be read: " + why,
                            "curl -F file=@dem.tif -F error=5 …: rasters as files, and options as fields", ""};
  return false;
}

bool FormReader::feed(std::string_view piece, const Sink& file) {
  if (state_ == State::epilogue) return true;
  rest_ += piece;
  if (delimiter_.empty() && !take_delimiter()) return !problem_;
  while (going_ && !problem_ && step(file)) {}
  return going_ && !problem_;
}

bool FormReader::step(const Sink& file) {
  if (state_ == State::epilogue) {
    rest_.clear();
    return false;
  }
  if (state_ == State::head) return head();
  if (state_ != State::boundary) return content(file);
  const std::size_t blank = std::min(rest_.find_first_not_of(" \t"), rest_.size());  // some senders pad the line
  if (blank > kLongestBoundary) return fail("a boundary is followed by blanks without end");
  if (rest_.size() < blank + 2) return false;
  const std::string after = rest_.substr(blank, 2);
  if (after != "--" && after != "\r\n") return fail("a boundary is followed by other words");
  rest_.erase(0, blank + (after == "--" ? 2 : 0));  // a head may be empty: its line break ends it
  state_ = after == "--" ? State::epilogue : State::head;
  return true;
}

/// Up to the next boundary; what could be the beginning of one waits for more.
bool FormReader::content(const Sink& file) {
  const std::size_t found = rest_.find(delimiter_);
  const std::size_t sure = found != rest_.npos ? found : rest_.size() - std::min(rest_.size(), delimiter_.size() - 1);
  if (!give(std::string_view(rest_).substr(0, sure), file)) return false;
  rest_.erase(0, sure);
  if (found == rest_.npos) return false;
  rest_.erase(0, delimiter_.size());
  state_ = State::boundary;
  return true;
}

/// Of a field.
bool FormReader::keep(std::size_t bytes) {
  kept_ += bytes;
  return kept_ <= kMostFields || fail("its fields have more than 64 KiB");
}

bool FormReader::give(std::string_view bytes, const Sink& file) {
  if (state_ == State::file) return going_ = bytes.empty() || file(bytes);
  if (state_ != State::field) return true;
  if (!keep(bytes.size())) return false;
  fields_.back().second += bytes;
  return true;
}

bool FormReader::head() {
  const std::size_t end = rest_.find("\r\n\r\n");
  if (end == rest_.npos) return rest_.size() > kMostHead && fail("a part's head has more than 8 KiB");
  const std::string lines = rest_.substr(2, end > 2 ? end - 2 : 0);
  if (proto::lower("\r\n" + lines).find("\r\ncontent-type: multipart/") != std::string::npos)
    return fail(
        "a part holds several files, as curl -F file=@a.tif,b.tif sends them; each has its own -F, and a name with a comma "
        "quotes: -F 'file=@\"a,b.tif\"'");
  const std::string line = disposition(lines);
  rest_.erase(0, end + 4);
  // Each takes memory beside its bytes, and moves what has come behind it.
  if (++parts_ > kMostParts) return fail("it has more than " + std::to_string(kMostParts) + " parts");
  const auto name = parameter(line, "name"), file = parameter(line, "filename");
  if (!name) return fail("a part has no name");
  if (!file) {
    if (!keep(name->size())) return false;
    fields_.emplace_back(*name, "");
    state_ = State::field;
    return true;
  }
  if (file_names_.size() == kMostFiles) return fail("it holds more than " + std::to_string(kMostFiles) + " files");
  file_names_.push_back(file->substr(file->find_last_of("/\\") + 1));
  state_ = State::file;
  return true;
}

}  // namespace cordillera::server
