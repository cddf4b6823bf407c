#include "server/front/codec.h"

#include <brotli/decode.h>
#include <brotli/encode.h>
#include <zlib.h>

#include <array>
#include <stdexcept>

namespace cordillera::server::front {
namespace {

constexpr std::size_t kPiece = std::size_t{32} << 10;  // what a sink is given at most
constexpr int kBrotliQuality = 5;

/// gzip, of one member or of several one after the other as bgzip writes them, and deflate: zlib sees which.
class Inflater : public Decoder {
 public:
  Inflater() {
    constexpr int kEither = 15 + 32;
    if (inflateInit2(&stream_, kEither) != Z_OK) throw std::runtime_error("zlib failed");
  }
  ~Inflater() override { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  bool take(std::string_view bytes, const Sink& sink) override {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream_.avail_in = static_cast<uInt>(bytes.size());
    bool full = false;  // then there may be more to come without a further byte
    while (stream_.avail_in > 0 || full) {
      if (ended_ && skip_padding()) return true;
      if (padded_) return false;
      if (ended_ && inflateReset(&stream_) != Z_OK) return false;
      stream_.next_out = out_.data();
      stream_.avail_out = static_cast<uInt>(out_.size());
      const int state = inflate(&stream_, Z_NO_FLUSH);
      if (state == Z_BUF_ERROR && full) return true;  // there was none
      if (state != Z_OK && state != Z_STREAM_END) return false;
      ended_ = state == Z_STREAM_END;
      full = !ended_ && stream_.avail_out == 0;
      const std::size_t count = out_.size() - stream_.avail_out;
      if (count > 0 && !sink({reinterpret_cast<const char*>(out_.data()), count})) return false;
    }
    return true;
  }
  bool ended() const override { return ended_; }

 private:
  /// Zeros behind the end, with which tapes and some programs fill a block, as gzip(1) takes them. True: there is nothing else.
  bool skip_padding() {
    for (; stream_.avail_in > 0 && *stream_.next_in == 0; ++stream_.next_in, --stream_.avail_in) padded_ = true;
    return stream_.avail_in == 0;
  }
  z_stream stream_{};
  bool ended_ = false, padded_ = false;
  std::array<Bytef, kPiece> out_{};
};

class Unbrotli : public Decoder {
 public:
  Unbrotli() : state_(BrotliDecoderCreateInstance(nullptr, nullptr, nullptr), BrotliDecoderDestroyInstance) {
    if (!state_) throw std::bad_alloc();
  }

  bool take(std::string_view bytes, const Sink& sink) override {
    const auto* next_in = reinterpret_cast<const std::uint8_t*>(bytes.data());
    std::size_t left = bytes.size();
    while (true) {
      std::uint8_t* next_out = out_.data();
      std::size_t room = out_.size();
      const auto state = BrotliDecoderDecompressStream(state_.get(), &left, &next_in, &room, &next_out, nullptr);
      if (state == BROTLI_DECODER_RESULT_ERROR) return false;
      const std::size_t count = out_.size() - room;
      if (count > 0 && !sink({reinterpret_cast<const char*>(out_.data()), count})) return false;
      if (state != BROTLI_DECODER_RESULT_NEEDS_MORE_OUTPUT) return left == 0;
    }
  }
  bool ended() const override { return BrotliDecoderIsFinished(state_.get()) == BROTLI_TRUE; }

 private:
  std::unique_ptr<BrotliDecoderState, decltype(&BrotliDecoderDestroyInstance)> state_;
  std::array<std::uint8_t, kPiece> out_{};
};

}  // namespace

std::string brotli(std::string_view bytes) {
  std::size_t size = BrotliEncoderMaxCompressedSize(bytes.size());
  std::string out(size, '\0');
  const auto* from = reinterpret_cast<const std::uint8_t*>(bytes.data());
  auto* to = reinterpret_cast<std::uint8_t*>(out.data());
  const auto done =
      BrotliEncoderCompress(kBrotliQuality, BROTLI_DEFAULT_WINDOW, BROTLI_MODE_GENERIC, bytes.size(), from, &size, to);
  if (done != BROTLI_TRUE) throw std::runtime_error("libbrotli failed");
  out.resize(size);
  return out;
}

std::unique_ptr<Decoder> decoder_of(std::string_view coding) {
  if (coding == "gzip" || coding == "x-gzip" || coding == "deflate") return std::make_unique<Inflater>();
  if (coding == "br") return std::make_unique<Unbrotli>();
  return nullptr;
}

}  // namespace cordillera::server::front
