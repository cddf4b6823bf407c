// Compressed bodies: read in any pieces, and whole only where their coding says so.
#include "server/front/codec.h"

#include <gtest/gtest.h>

#include "pipeline/exports/gzip.h"
#include "server/front/content_coding.h"

namespace cordillera::server::front {
namespace {

std::string text() {
  std::string out;
  for (int i = 0; i < 20000; ++i) out += std::to_string(i * 7919 % 1000) + ',';
  return out;
}

std::string packed(const std::string& coding, const std::string& bytes) {
  return coding == "br" ? brotli(bytes) : pipeline::exports::gzip(bytes);
}

struct Read {
  bool whole;
  std::string bytes;
};

/// The body in pieces of so many bytes.
Read read(const std::string& coding, const std::string& body, std::size_t piece) {
  Read seen;
  const auto reader = decoding(coding, [&](const Request::Sink& sink) {
    for (std::size_t at = 0; at < body.size(); at += piece) {
      if (!sink(std::string_view(body).substr(at, piece))) return false;
    }
    return true;
  });
  seen.whole = reader([&](std::string_view bytes) {
    seen.bytes.append(bytes);
    return true;
  });
  return seen;
}

TEST(Codec, WhatWasPackedComesBackInWhateverPieces) {
  for (const std::string& plain : {text(), std::string(), std::string(1 << 20, 'x')}) {
    for (const char* coding : {"gzip", "GZip", "x-gzip", "br", "BR"}) {
      const std::string body = packed(std::string(coding) == "BR" ? "br" : coding, plain);
      for (const std::size_t piece : {body.size(), std::size_t{1}, std::size_t{1000}}) {
        const Read seen = read(coding, body, piece);
        EXPECT_TRUE(seen.whole) << coding << " " << piece;
        EXPECT_EQ(seen.bytes, plain) << coding << " " << piece;
      }
    }
    EXPECT_EQ(read("identity", plain, 100).bytes, plain);
  }
}

TEST(Codec, ZerosBehindTheEndOfAGzipAreNone) {
  const std::string plain = text(), body = packed("gzip", plain), zeros(1000, '\0');
  for (const std::size_t piece : {body.size() + zeros.size(), std::size_t{1}, std::size_t{1000}}) {
    const Read seen = read("gzip", body + zeros, piece);
    EXPECT_TRUE(seen.whole) << piece;
    EXPECT_EQ(seen.bytes, plain) << piece;
    EXPECT_FALSE(read("gzip", body + zeros + "x", piece).whole) << piece;
    EXPECT_FALSE(read("gzip", body + zeros + body, piece).whole) << piece;
  }
}

TEST(Codec, WhatStopsBeforeItsEndIsNotWhole) {
  const std::string plain = text().substr(0, 3000);
  for (const char* coding : {"gzip", "br"}) {
    const std::string body = packed(coding, plain);
    for (std::size_t size = 0; size < body.size(); ++size)
      EXPECT_FALSE(read(coding, body.substr(0, size), 4096).whole) << coding << " " << size;
  }
  const std::string body = packed("gzip", plain);
  const Read cut = read("gzip", body.substr(0, body.size() - 8), 4096);
  EXPECT_EQ(cut.bytes, plain) << "all is there but the checksum and the length";
  EXPECT_FALSE(cut.whole);
  std::string wrong = body;
  wrong[wrong.size() - 6] ^= 1;
  EXPECT_FALSE(read("gzip", wrong, 4096).whole) << "the checksum is another";
}

TEST(Codec, AfterTheEndOnlyAnotherMemberMayCome) {
  const std::string one = packed("gzip", "one"), two = packed("gzip", "two");
  for (const std::size_t piece : {1, 5, 4096}) EXPECT_EQ(read("gzip", one + two, piece).bytes, "onetwo");
  EXPECT_TRUE(read("gzip", one + two, 7).whole);
  EXPECT_FALSE(read("gzip", one + two.substr(0, two.size() - 1), 7).whole);
  EXPECT_FALSE(read("gzip", one + "rest", 4096).whole);
  EXPECT_FALSE(read("br", packed("br", "one") + "rest", 4096).whole);
}

TEST(Codec, ASinkThatHasEnoughEndsIt) {
  for (const char* coding : {"gzip", "br"}) {
    std::size_t size = 0;
    const std::string body = packed(coding, std::string(std::size_t{64} << 20, '\0'));
    const auto reader = decoding(coding, [&](const Request::Sink& sink) { return sink(body); });
    EXPECT_FALSE(reader([&](std::string_view bytes) { return (size += bytes.size()) < 100000; }));
    EXPECT_LT(size, 200000u) << coding;
  }
}

TEST(Codec, OtherCodingsAreRefused) {
  const auto problem = [](const std::string& coding) {
    Request request;
    request.headers["content-encoding"] = coding;
    return coding_problem(request);
  };
  for (const char* coding : {"zstd", "compress", "gzip, gzip", "gzip,br", "gzipped", "b r", "*"}) {
    ASSERT_TRUE(problem(coding)) << coding;
    EXPECT_EQ(problem(coding)->type, "coding-unknown");
  }
  for (const char* coding : {"", "identity", "Identity", "GZIP", "Deflate", "Br"}) EXPECT_FALSE(problem(coding)) << coding;
  EXPECT_FALSE(coding_problem({}));
}

}  // namespace
}  // namespace cordillera::server::front
