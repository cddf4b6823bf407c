#include "server/front/content_coding.h"

#include "pipeline/exports/gzip.h"
#include "server/front/codec.h"
#include "server/http/conditions.h"
#include "server/http/gzip.h"

namespace cordillera::server::front {
namespace {

constexpr std::size_t kWorthIt = 128;  // bytes; less would hardly shrink

std::string compressed(std::string_view coding, const std::string& bytes) {
  return coding == "br" ? brotli(bytes) : pipeline::exports::gzip(bytes, pipeline::exports::kQuick);
}

}  // namespace

std::shared_ptr<const std::string> ContentCoder::kept(const std::string& name, const std::function<std::string()>& make) {
  if (auto found = kept_.find(name)) return *found;
  auto bytes = std::make_shared<const std::string>(make());
  kept_.keep(name, bytes, bytes->size() + name.size());
  return bytes;
}

void ContentCoder::encode(const Request& request, Response& response) {
  const bool reads = request.method == "GET" || request.method == "HEAD";
  const std::string coding(preferred_coding(request, {"br", "gzip"}));
  if (reads && !coding.empty() && response.status == 304 && is_guarded(response)) return name_coding(response, coding);
  if (!reads || response.bytes().size() < kWorthIt || !is_compressible(response.header("Content-Type"))) return;
  if (!response.header("Content-Encoding").empty() || response.status == 206) return;  // a part is one of the bytes as they are
  const std::string tag = response.header("ETag");
  const bool keep = response.status == 200 && !tag.empty();
  if (coding.empty()) return;
  const auto make = [&] { return compressed(coding, response.bytes()); };
  std::shared_ptr<const std::string> bytes;
  if (!keep)
    bytes = std::make_shared<const std::string>(make());
  else
    bytes = response.keep ? response.keep(coding + tag, make) : kept(coding + tag, make);
  if (bytes->empty()) return;
  response.body.clear();
  response.shared = std::move(bytes);
  response.set("Content-Encoding", coding);
  if (is_guarded(response)) name_coding(response, coding);
}

std::optional<proto::Problem> coding_problem(const Request& request) {
  const std::string coding = coding_of(request.header("content-encoding").value_or(""));
  if (coding.empty() || decoder_of(coding)) return std::nullopt;
  return proto::Problem{"coding-unknown", "the body has a Content-Encoding that this service cannot read",
                        std::string("one of ") + kCodings + ", or none", "Content-Encoding"};
}

BodyReader decoding(const std::string& content_encoding, BodyReader encoded, std::shared_ptr<bool> misread) {
  return [coding = coding_of(content_encoding), encoded = std::move(encoded),
          misread = std::move(misread)](const Request::Sink& sink) {
    const auto decoder = decoder_of(coding);
    if (!decoder) return encoded(sink);
    bool wanted = true;
    const Decoder::Sink take = [&](std::string_view piece) { return wanted = sink(piece); };
    const bool came = encoded([&](std::string_view piece) {
      const bool read = decoder->take(piece, take);
      if (!read && wanted && misread) *misread = true;
      return read;
    });
    return came && decoder->ended();
  };
}

}  // namespace cordillera::server::front
