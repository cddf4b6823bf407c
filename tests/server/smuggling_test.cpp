// Requests that two programs may read in two ways, a row each of tests/attack/smuggling.tsv: what is answered, and so how the
// connection was cut.
#include <gtest/gtest.h>

#include <fstream>

#include "front_fixture.h"

namespace cordillera::server {
namespace {

const std::string kPost = "POST /v1/datasets?name=a HTTP/1.1\r\nHost: localhost\r\n";
const std::string kNext = "GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";

std::string bytes_of(const std::string& text) {
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '{') {
      bytes += text.compare(i, 6, "{post}") == 0 ? kPost : kNext;
      i += 5;
    } else if (c == '\\' && text.at(i + 1) == 'x') {
      bytes += static_cast<char>(std::stoi(text.substr(i + 2, 2), nullptr, 16));
      i += 3;
    } else if (c == '\\') {
      const char next = text.at(++i);
      bytes += next == 'r' ? '\r' : next == 'n' ? '\n' : next == 't' ? '\t' : next;
    } else {
      bytes += c;
    }
  }
  return bytes;
}

/// "202 200": of all answers on the connection. A dataset whose job has ended already is answered with 201; that is no difference
/// of reading.
std::string statuses(const std::string& answers) {
  static const std::string kMark = "HTTP/1.1 ";
  std::string found;
  for (std::size_t at = answers.find(kMark); at != answers.npos; at = answers.find(kMark, at + 1)) {
    std::string status = answers.substr(at + kMark.size(), 3);
    if (status == "201") status = "202";
    if (status.find_first_not_of("0123456789") == status.npos) found += (found.empty() ? "" : " ") + status;
  }
  return found;
}

TEST(Smuggling, EveryRowIsReadInOneWay) {
  Front front;
  std::ifstream table(CORDILLERA_SMUGGLING);
  std::size_t rows = 0;
  for (std::string line; std::getline(table, line);) {
    if (line.starts_with('#')) continue;
    const auto first = line.find('\t'), second = line.find('\t', first + 1), third = line.find('\t', second + 1);
    ASSERT_NE(third, line.npos) << line;
    RawClient client = front.client();
    client.say(bytes_of(line.substr(first + 1, second - first - 1)));
    client.half_close();
    EXPECT_EQ(statuses(client.rest()), line.substr(second + 1, third - second - 1)) << line.substr(0, first);
    ++rows;
  }
  EXPECT_GT(rows, 200u);
}

}  // namespace
}  // namespace cordillera::server
