// Bodies in chunks: what they come to does not depend on how their bytes arrive.
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "server/front/message/body_framing.h"

namespace cordillera::server::front {
namespace {

using namespace std::string_literals;

enum class End { open, done, broken };

struct Read {
  End end = End::open;
  std::string data;
  std::size_t used = 0;  ///< bytes until the body was whole

  bool operator==(const Read& other) const {
    return end == other.end && data == other.data && (end != End::done || used == other.used);
  }
};

std::ostream& operator<<(std::ostream& out, const Read& read) {
  const char* const end = read.end == End::done ? "done" : read.end == End::broken ? "broken" : "open";
  return out << end << " after " << read.used << " bytes, data '" << read.data << "'";
}

BodyFraming chunks() {
  Head head;
  head.body = Head::Body::chunked;
  return BodyFraming(head);
}

/// cuts: where one read ends and the next begins, ascending.
Read read_in_pieces(std::string_view wire, std::vector<std::size_t> cuts) {
  BodyFraming framing = chunks();
  Read read;
  cuts.push_back(wire.size());
  std::size_t at = 0;
  for (const std::size_t cut : cuts) {
    while (at < cut && !framing.done() && !framing.broken()) at += framing.take(wire.substr(at, cut - at), &read.data);
  }
  read.used = at;
  read.end = framing.done() ? End::done : framing.broken() ? End::broken : End::open;
  return read;
}

/// In one read, byte by byte, and cut at every place and every two.
void expect_read(const std::string& wire, const Read& expected) {
  EXPECT_EQ(read_in_pieces(wire, {}), expected) << wire;
  std::vector<std::size_t> all;
  for (std::size_t cut = 1; cut < wire.size(); ++cut) all.push_back(cut);
  EXPECT_EQ(read_in_pieces(wire, all), expected) << "byte by byte: " << wire;
  for (std::size_t one = 0; one <= wire.size(); ++one) {
    for (std::size_t two = one; two <= wire.size(); ++two) {
      ASSERT_EQ(read_in_pieces(wire, {one, two}), expected) << "cut at " << one << " and " << two << ": " << wire;
    }
  }
}

TEST(Chunks, AreTheSameHoweverTheyArrive) {
  struct Body {
    const char* wire;
    const char* data;
  };
  for (const auto& [wire, data] : {
           Body{"0\r\n\r\n", ""},
           Body{"000\r\n\r\n", ""},
           Body{"00;a=\"b\"\r\nT: u\r\nU:\r\n\r\n", ""},
           Body{"0\r\nT: u\r\n\r\n", ""},
           Body{"3\r\nabc\r\n0\r\n\r\n", "abc"},
           Body{"3\r\nabc\r\nA;x=y\r\n0123456789\r\n0\r\nT: u\r\n\r\n", "abc0123456789"},
           Body{"2\r\n\r\n\r\n2\r\n0\r\r\n5\r\n0\r\n\r\n\r\n0\r\n\r\n", "\r\n0\r0\r\n\r\n"},
           Body{"1\r\n\n\r\n1\r\n\r\r\n0\r\n\r\n", "\n\r"},
       }) {
    const std::string body = wire;
    expect_read(body, {End::done, data, body.size()});
    expect_read(body + "next", {End::done, data, body.size()});
    expect_read(body + "\r\n0\r\n\r\n", {End::done, data, body.size()});
  }
}

TEST(Chunks, AreBrokenHoweverTheyArrive) {
  const char* const ends[] = {"0\r\n\n",
                              "0\r\n\n\r\n",
                              "0\r\n\r\r\n",
                              "0\r\n\rX",
                              "0\r\n\r\r",
                              "0\r\nT: u\n",
                              "0\r\nT: u\n\r\n\r\n",
                              "0\r\nT: u\rV: w\r\n\r\n",
                              "0\r\nT: u\r\n\n",
                              "0\r\nT: u\r\n\r\r\n",
                              "0\n",
                              "0\n\n",
                              "0\r\r\n",
                              "0\rX",
                              "0;a\nb",
                              "0\r\nT\r\n\r\n",
                              "0\r\n: u\r\n\r\n",
                              "0\r\nT: u\r\n v\r\n\r\n",
                              "0\r\nContent-Length: 3\r\n\r\n",
                              "0 \r\n\r\n",
                              "0;\r\n\r\n",
                              "-0\r\n\r\n",
                              "\r\n\r\n\r\n",
                              "1\n",
                              "1\r\nabc\r\n",
                              "1\r\na\r\r\n",
                              "1\r\na\n",
                              "1\r\na\rb",
                              "1\r\na0\r\n\r\n",
                              "10000000000000000\r\n"};
  for (const std::string end : ends) {
    for (const std::string& begin : {""s, "3\r\nabc\r\n"s}) {
      const std::string data = begin.empty() ? "" : "abc", more = end.starts_with("1\r\na") ? "a" : "";
      expect_read(begin + end, {End::broken, data + more});
      expect_read(begin + end + "GET / HTTP/1.1\r\nHost: a\r\n\r\n", {End::broken, data + more});
    }
  }
}

TEST(Chunks, AreOpenUntilTheirLastByte) {
  const std::string wire = "3\r\nabc\r\nA;x=y\r\n0123456789\r\n0;z\r\nT: u\r\n\r\n", data = "abc0123456789";
  for (std::size_t size = 0; size < wire.size(); ++size) {
    const auto within = [size](std::size_t begin, std::size_t count) { return std::min(size - std::min(size, begin), count); };
    expect_read(wire.substr(0, size), {End::open, data.substr(0, within(3, 3) + within(15, 10))});
  }
}

TEST(Chunks, WhatIsNoDataHasABound) {
  const auto broken = [](const std::string& begin, const std::string& again) {
    BodyFraming framing = chunks();
    std::string body;
    framing.take(begin, &body);
    for (int i = 0; i < 20000 && !framing.broken(); ++i) framing.take(again, &body);
    return framing.broken();
  };
  EXPECT_TRUE(broken("1;a=", "b")) << "an extension without end";
  EXPECT_TRUE(broken("0", "0")) << "a size without end";
  EXPECT_TRUE(broken("", "1;a=b\r\nx\r\n")) << "extensions without end";
  EXPECT_TRUE(broken("0\r\n", "X: y\r\n")) << "trailers without end";
  EXPECT_TRUE(broken("0\r\n" + std::string(10000, 'X') + ": y\r\n\r\n", "")) << "a long one in one piece";
  EXPECT_FALSE(broken("", "1\r\nx\r\n")) << "data without end";
}

/// Around the bound too.
TEST(Chunks, LongLinesAreTheSameInOnePieceAndByteByByte) {
  struct Around {
    const char *begin, *end;
  };
  int whole = 0, refused = 0;
  for (std::size_t size = 8170; size < 8200; ++size) {
    for (const auto& [begin, end] : {Around{"", "\r\n\r\n"}, Around{"1\r\nx\r\n", "\r\n\r\n"}, Around{"0;a=", "\r\n\r\n"},
                                     Around{"0\r\nX: ", "\r\n\r\n"}, Around{"1\r\nx\r\n0\r\nX: ", "\r\nY: z\r\n\r\n"},
                                     Around{"", "1\r\nx\r\n0\r\n\r\n"}, Around{"1;a=b\r\nx\r\n0\r\nX: ", "\r\n\r\n"}}) {
      const std::string wire = begin + std::string(size, '0') + end;
      std::vector<std::size_t> all;
      for (std::size_t cut = 1; cut < wire.size(); ++cut) all.push_back(cut);
      const Read one = read_in_pieces(wire, {});
      EXPECT_EQ(read_in_pieces(wire, all).end, one.end) << size << " " << wire.substr(0, 20);
      (one.end == End::done ? whole : refused) += 1;
    }
  }
  EXPECT_GT(whole, 20);
  EXPECT_GT(refused, 20);
}

}  // namespace
}  // namespace cordillera::server::front
