#include "server/options/spoken_words.h"

#include "server/options/option_values.h"
#include "server/options/options.h"

namespace cordillera::server {
namespace {

constexpr std::size_t kNumbersOfABox = 4;

/// A number, and a comma behind it as in "10, 46, 11, 47".
bool is_number(std::string word) {
  double value = 0;
  if (word.ends_with(',')) word.pop_back();
  return !read_number(word, {-1e9, 1e9}, &value);
}

std::string joined(const std::vector<std::string>& words, std::size_t first) {
  std::string text;
  for (std::size_t k = first; k < first + kNumbersOfABox; ++k) {
    std::string number = words[k];
    if (number.ends_with(',')) number.pop_back();
    text += (text.empty() ? "" : ",") + number;
  }
  return text;
}

}  // namespace

std::vector<std::string> understood(std::vector<std::string> words) {
  if (!words.empty() && words[0] == "help") {
    words.erase(words.begin());
    words.insert(words.size() > 0 ? words.begin() + 1 : words.begin(), "--help");
  }
  if (words.size() == 1 && (words[0] == "version" || words[0] == "-v" || words[0] == "-V")) words[0] = "--version";
  std::vector<std::string> out;
  for (std::size_t k = 0; k < words.size(); ++k) {
    out.push_back(words[k]);
    if (words[k] != "--bbox" || k + kNumbersOfABox >= words.size()) continue;
    bool numbers = true;
    for (std::size_t n = 1; n <= kNumbersOfABox; ++n) numbers = numbers && is_number(words[k + n]);
    if (!numbers) continue;
    out.push_back(joined(words, k + 1));
    k += kNumbersOfABox;
  }
  return out;
}

std::string listen_address(const std::string& host, const std::string& port) {
  const std::string usual = ServeSettings().listen;
  const auto colon = usual.rfind(':');
  const bool bare = host.find(':') != host.npos && !host.starts_with('[');
  return (host.empty() ? usual.substr(0, colon) : bare ? "[" + host + "]" : host) + ":" + (port.empty() ? usual.substr(colon + 1) : port);
}

}  // namespace cordillera::server
