#include "raster/open/text_grid.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <string_view>
#include <vector>

#include "proto/letters.h"
#include "proto/utf8.h"
#include "raster/open/at_hand.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kReadAtOnce = 1 << 20, kMostOfWord = 64;
constexpr std::uint64_t kMostOfKeywords = 2;  // words of a line such as "ncols 20"

/// What was seen of a file.
struct Words {
  bool not_finite = false;
  std::string word;  ///< the first that is no number; empty: none
  std::uint64_t line = 0;
};

/// Whether a line of the header begins so.
bool is_keyword(std::string_view word) {
  constexpr std::string_view kBeginnings[] = {"ncols", "nrows", "xll", "yll", "cellsize", "dx", "dy", "nodata"};
  const std::string lower = proto::lower(word);
  return std::any_of(std::begin(kBeginnings), std::end(kBeginnings),
                     [&](std::string_view begin) { return lower.starts_with(begin); });
}

bool is_not_finite(std::string_view word) {
  if (word.starts_with('-') || word.starts_with('+')) word.remove_prefix(1);
  const std::string lower = proto::lower(word);
  // "1.#INF" and "1.#QNAN" are of Microsoft's library.
  return lower == "nan" || lower == "inf" || lower == "infinity" || lower.starts_with("nan(") || lower.starts_with("1.#");
}

class Reader {
 public:
  void add(std::string_view piece) {
    for (const char c : piece) {
      if (c == ' ' || c == '\t' || c == '\r' || c == '\n') {
        end_word();
        if (c == '\n') ++line_, words_on_line_ = 0;
        continue;
      }
      // Of numbers, which are nearly all there is, no letter is looked at twice.
      is_word_ = is_word_ || (proto::is_letter(c) && c != 'e' && c != 'E') || c == '#';
      if (word_.size() < kMostOfWord) word_ += c;
    }
  }
  Words end() {
    end_word();
    return seen_;
  }

 private:
  void end_word() {
    if (word_.empty()) return;
    if (is_word_) look();
    // "a b c" where the first row should be: GDAL would pass over it.
    if (++words_on_line_ > kMostOfKeywords && keyword_line_ == line_ && !is_known_ && seen_.word.empty())
      seen_.word = keyword_, seen_.line = line_;
    is_word_ = false;
    word_.clear();
  }
  void look() {
    if (keyword_line_ == line_) return;  // "nodata_value nan"
    const bool not_finite = is_not_finite(word_);
    const bool above_values = keyword_line_ + 1 == line_ || line_ == 1;
    if (above_values && words_on_line_ == 0 && !not_finite) {  // "ncols 20"
      keyword_line_ = line_;
      keyword_ = word_;
      is_known_ = is_keyword(word_);
      return;
    }
    seen_.not_finite = seen_.not_finite || not_finite;
    if (!not_finite && seen_.word.empty()) seen_.word = word_, seen_.line = line_;
  }

  Words seen_;
  std::string word_, keyword_;
  std::uint64_t line_ = 1, words_on_line_ = 0, keyword_line_ = 0;  ///< the last one that begins with a keyword
  bool is_word_ = false, is_known_ = false;
};

Words read_all(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<char> piece(kReadAtOnce);
  Reader reader;
  while (file) {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    reader.add({piece.data(), static_cast<std::size_t>(file.gcount())});
  }
  return reader.end();
}

/// What was seen of files, by path and state: each thread of a build opens the same ones. Who wants one that is being read waits.
struct Seen {
  std::once_flag once;
  Words words;
};
constexpr std::size_t kMostSeen = 4096;
std::mutex g_mutex;
std::map<std::string, std::shared_ptr<Seen>> g_seen;

std::shared_ptr<Seen> seen_of(const std::string& key) {
  const std::lock_guard lock(g_mutex);
  if (g_seen.size() >= kMostSeen) g_seen.clear();
  auto& seen = g_seen[key];
  if (!seen) seen = std::make_shared<Seen>();
  return seen;
}

}  // namespace

proto::Result<bool> has_not_finite(const std::string& path, const std::string& name) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;
  // A posted file is opened by a link, of another name each time.
  const auto seen = seen_of(copy_key(fs::canonical(path, error).string(), ""));
  std::call_once(seen->once, [&] { seen->words = read_all(path); });
  const Words& words = seen->words;
  if (words.word.empty()) return words.not_finite;
  return proto::Problem{"raster-unreadable",
                        name + " has \"" + proto::shown_text(words.word) + "\" in line " + std::to_string(words.line) +
                            ", where a height should be",
                        "numbers, and nan or the nodata_value where there is no height", ""};
}

}  // namespace cordillera::raster
