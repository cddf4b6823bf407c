#include "server/front/message/beast.h"

#include <algorithm>
#include <boost/beast/http/basic_parser.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/status.hpp>
#include <limits>

namespace cordillera::server::front {
namespace {

namespace http = boost::beast::http;
using Error = boost::beast::error_code;
using Text = boost::beast::string_view;

constexpr int kMostSizeBits = 60;
constexpr std::size_t kMostOverhead = 8192;  // of all chunks of a body beyond their data and sizes; of a line that is not whole
constexpr std::size_t kMostLine = kMostOverhead + 1;  // what slow bytes can come to: all but the last is a line that is not whole

std::string_view plain(Text text) { return {text.data(), text.size()}; }

/// Whether carriage returns and line feeds stand together, as they must where no data is. Looked at from `from` on; the next byte
/// may be a line feed.
bool has_plain_line_ends(std::string_view lines, std::size_t from = 0) {
  for (std::size_t i = from; i < lines.size(); ++i) {
    if (lines[i] == '\n' && (i == 0 || lines[i - 1] != '\r')) return false;
    if (i > 0 && lines[i - 1] == '\r' && lines[i] != '\n') return false;
  }
  return true;
}

bool is_control(char c) { return (static_cast<unsigned char>(c) < 0x20 && c != '\t') || c == 0x7f; }

/// Does nothing with what it reads.
class Silent : public http::basic_parser<true> {
  void on_request_impl(http::verb, Text, Text, int, Error&) override {}
  void on_response_impl(int, Text, int, Error&) override {}
  void on_field_impl(http::field, Text, Text, Error&) override {}
  void on_header_impl(Error&) override {}
  void on_body_init_impl(const boost::optional<std::uint64_t>&, Error&) override {}
  std::size_t on_body_impl(Text body, Error&) override { return body.size(); }
  void on_chunk_header_impl(std::uint64_t, Text, Error&) override {}
  std::size_t on_chunk_body_impl(std::uint64_t, Text body, Error&) override { return body.size(); }
  void on_finish_impl(Error&) override {}
};

class HeadParser : public Silent {
 public:
  explicit HeadParser(RawHead* head) : head_(head) {}

 private:
  void on_request_impl(http::verb, Text method, Text target, int version, Error&) override {
    head_->method = plain(method);
    head_->target = plain(target);
    head_->old = version == 10;
  }
  void on_field_impl(http::field, Text name, Text value, Error&) override {
    head_->fields.emplace_back(plain(name), plain(value));
  }

  RawHead* head_;
};

std::string words_of(const Error& error) {
  if (error == http::error::bad_method) return "the method is none";
  if (error == http::error::bad_target) return "the address holds blanks or control characters";
  if (error == http::error::bad_version) return "the request line does not end with a version";
  if (error == http::error::bad_field) return "a header has no plain name";
  if (error == http::error::bad_value) return "a header holds what it must not";
  if (error == http::error::bad_content_length) return "Content-Length is not one number";
  if (error == http::error::bad_transfer_encoding) return "Transfer-Encoding stands there twice, or beside Content-Length";
  return error.message();
}

}  // namespace

std::string parse_head(std::string_view bytes, RawHead* head) {
  HeadParser parser(head);
  parser.header_limit(static_cast<std::uint32_t>(std::min<std::size_t>(bytes.size(), std::numeric_limits<std::uint32_t>::max())));
  parser.body_limit(std::numeric_limits<std::uint64_t>::max());  // 1.74 refuses every length where there is none
  Error error;
  parser.put({bytes.data(), bytes.size()}, error);
  if (error) return words_of(error);
  return parser.is_header_done() ? "" : "the head has no end";
}

std::string_view reason_of(int status) { return plain(http::obsolete_reason(static_cast<http::status>(status))); }

class ChunkParser::Parser : public Silent {
 public:
  Parser() {
    eager(true);
    body_limit(boost::none);
    // Beast reads chunks only behind a head that announces them; ours is read by then.
    static constexpr std::string_view kHead = "POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n";
    Error error;
    put({kHead.data(), kHead.size()}, error);
  }

  /// The rules that are Beast's, and those that it has not.
  bool take(std::string_view bytes, std::string* body, std::size_t* used) {
    body_ = body;
    line_ = bytes.data();
    last_ = nullptr;
    Error error;
    *used = put({bytes.data(), bytes.size()}, error);
    if (error && error != http::error::need_more) return false;
    return !is_done() || may_end(bytes.data() + *used);
  }

 private:
  void on_chunk_header_impl(std::uint64_t size, Text extensions, Error& error) override {
    overhead_ += extensions.size();
    const char* const end = extensions.data() + extensions.size();
    const bool blank = !extensions.empty() && extensions.front() != ';';
    const bool control = std::any_of(extensions.begin(), extensions.end(), is_control);
    const bool large = overhead_ > kMostOverhead || size_of_line(end + 2) > kMostLine;
    if (blank || control || large) error = http::error::bad_chunk_extension;
    if (size >> kMostSizeBits != 0) error = http::error::bad_chunk;
    if (size == 0) last_ = end;
  }
  std::size_t on_chunk_body_impl(std::uint64_t, Text data, Error&) override {
    body_->append(data.data(), data.size());
    line_ = data.data() + data.size();
    return data.size();
  }
  /// Trailers are read by Beast, and by nobody else.
  bool may_end(const char* end) const {
    const std::string_view trailers(last_, static_cast<std::size_t>(end - last_));
    const bool folded = trailers.find("\n ") != trailers.npos || trailers.find("\n\t") != trailers.npos;
    return !folded && overhead_ + trailers.size() <= kMostOverhead && size_of_line(end) <= kMostLine;
  }
  std::size_t size_of_line(const char* end) const { return static_cast<std::size_t>(end - line_); }

  std::string* body_ = nullptr;
  const char* line_ = nullptr;  ///< where the line of a chunk begins, with the end of the data before it
  const char* last_ = nullptr;  ///< the end of the last chunk's line
  std::size_t overhead_ = 0;
};

ChunkParser::ChunkParser() : parser_(std::make_unique<Parser>()) {}
ChunkParser::~ChunkParser() = default;
bool ChunkParser::done() const { return !broken_ && parser_->is_done(); }

std::size_t ChunkParser::take(std::string_view bytes, std::string* body) {
  if (broken_ || done()) return 0;
  const bool joined = !held_.empty();
  if (joined) {
    const std::size_t before = held_.size(), line_end = bytes.find('\n');
    const bool whole = line_end != bytes.npos;
    held_.append(bytes);
    // A line is looked at when it is whole: 1.74 asserts that a last chunk which it has seen once comes back two bytes longer.
    const std::string_view line = std::string_view(held_).substr(0, whole ? before + line_end + 1 : held_.size());
    broken_ = !has_plain_line_ends(line, before) || (!whole && line.size() > kMostOverhead);
    if (broken_ || !whole) return bytes.size();
  }
  const std::string_view all = joined ? std::string_view(held_) : bytes;
  std::size_t used = 0;
  broken_ = !parser_->take(all, body, &used);
  const std::size_t left = all.size() - used;
  if (broken_ || parser_->is_done()) return bytes.size() - std::min(bytes.size(), left);
  broken_ = left > kMostOverhead || !has_plain_line_ends(all.substr(used));
  held_ = std::string(all.substr(used));
  return bytes.size();
}

}  // namespace cordillera::server::front
