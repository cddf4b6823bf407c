#include "raster/open/point_lines.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <initializer_list>
#include <vector>

#include "proto/letters.h"
#include "proto/utf8.h"
#include "raster/gdal/formats.h"
#include "raster/open/dataset.h"

namespace cordillera::raster {
namespace {

struct PointXy {
  double x = 0, y = 0;
};

std::optional<double> next_number(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(" \t,;\""), line.size()));
  if (line.starts_with('+')) line.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value);
  if (error != std::errc()) return std::nullopt;
  line.remove_prefix(static_cast<std::size_t>(end - line.data()));
  return value;
}

/// What stands in which column, counted from 1, as GDAL takes it: by the names in the first line, if there are any.
struct Columns {
  char separator = ' ';  ///< or a tab: blanks of any number
  bool named = false;
  std::size_t x = 1, y = 2;
};

char separator_of(std::string_view line) {
  for (const char separator : {';', ','})
    if (line.find(separator) != line.npos) return separator;
  return ' ';
}

/// Words of a line between separators, without quotes and blanks around.
std::vector<std::string> words_of(std::string_view line, std::string_view separators) {
  constexpr std::string_view kAround = " \t\r\"'";
  std::vector<std::string> words;
  const bool blanks = separators.find(' ') != separators.npos;  // any number of them
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = std::min(line.find_first_of(separators, at), line.size());
    const std::string_view word = line.substr(at, end - at);
    const std::size_t first = word.find_first_not_of(kAround), last = word.find_last_not_of(kAround);
    if (first != word.npos)
      words.emplace_back(word.substr(first, last - first + 1));
    else if (!blanks)
      words.emplace_back();
    at = end + 1;
  }
  return words;
}

/// Which of the names stands for what, counted from 1; 0: none.
struct NamedColumns {
  std::size_t x = 0, y = 0, z = 0;
  bool all() const { return x > 0 && y > 0 && z > 0; }
  friend bool operator==(const NamedColumns&, const NamedColumns&) = default;
};

bool begins_with_any(const std::string& name, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(), [&](const char* word) { return name.starts_with(word); });
}

/// As people name them. The first of several counts.
NamedColumns named(const std::vector<std::string>& words) {
  NamedColumns found;
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string word = proto::lower(words[k]), letter = word.substr(0, word.find_first_of(" (["));
    if (found.x == 0 && (letter == "x" || begins_with_any(word, {"lon", "east"}))) found.x = k + 1;
    if (found.y == 0 && (letter == "y" || begins_with_any(word, {"lat", "north"}))) found.y = k + 1;
    if (found.z == 0 && (names_heights(letter) || begins_with_any(word, {"elev", "alt", "height"}))) found.z = k + 1;
  }
  return found;
}

/// As GDAL's driver finds them: it parts words at blanks, too, and the last of several counts.
NamedColumns named_for_gdal(std::string_view line) {
  constexpr std::size_t kLongest = 100;  // that it reads
  NamedColumns found;
  if (line.size() > kLongest) return found;
  const std::vector<std::string> words = words_of(line, " ,\t;");
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string word = proto::lower(words[k]);
    if (word == "x" || begins_with_any(word, {"lon", "east"}))
      found.x = k + 1;
    else if (word == "y" || begins_with_any(word, {"lat", "north"}))
      found.y = k + 1;
    else if (word == "z" || word == "height" || word.starts_with("alt"))
      found.z = k + 1;
  }
  return found;
}

std::string_view first_line(std::string_view text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  return line.substr(0, line.find('\r'));
}

/// Without the sign of a comment.
std::string_view uncommented(std::string_view line) {
  for (const std::string_view sign : {"#", "//", "%"})
    if (line.starts_with(sign)) return line.substr(sign.size());
  return line;
}

/// Whether a line has so many numbers and nothing else in their places.
bool has_numbers(std::string_view line, std::size_t columns) {
  const char separator = separator_of(line);
  const std::vector<std::string> words = words_of(line, separator == ' ' ? " \t" : std::string_view(&separator, 1));
  if (words.size() < columns) return false;
  std::size_t numbers = 0;
  for (const std::string& word : words) {
    std::string_view rest = word;
    numbers += next_number(rest) ? 1 : 0;
  }
  return numbers >= 3;
}

Columns columns_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string first;
  std::getline(file, first);
  Columns columns;
  columns.separator = separator_of(first);
  std::string_view line = first;
  columns.named = !next_number(line);
  if (!columns.named) return columns;
  const std::string separators(1, columns.separator);
  const NamedColumns found = named(words_of(uncommented(first_line(first)), columns.separator == ' ' ? " \t" : separators));
  if (found.x > 0 && found.y > 0) columns.x = found.x, columns.y = found.y;
  return columns;
}

/// The numbers of a line that are x and y, if it has them.
std::optional<PointXy> point_of(std::string_view line, const Columns& columns) {
  std::optional<double> x, y;
  for (std::size_t k = 1; k <= std::max(columns.x, columns.y); ++k) {
    const auto value = next_number(line);
    if (k == columns.x) x = value;
    if (k == columns.y) y = value;
  }
  return x && y ? std::optional(PointXy{*x, *y}) : std::nullopt;
}

}  // namespace

std::string sorting_line(const std::string& path, const std::string& name) {
  const Columns columns = columns_of(path);
  const auto key = [](std::size_t column, const char* how) {
    const std::string number = std::to_string(column);
    return " -k " + number + "," + number + how;
  };
  // Other languages have other decimal points. A whole line never decides, so that equal points stay as they are.
  std::string sort = "LC_ALL=C sort -s";
  if (columns.separator != ' ') sort += std::string(" -t '") + columns.separator + "'";
  sort += key(columns.y, "gr") + key(columns.x, "g");
  const std::string file = shell_word(name), to = name == "sorted.xyz" ? "sorted-2.xyz" : "sorted.xyz";
  if (columns.named) return "(head -n 1 " + file + "; tail -n +2 " + file + " | " + sort + ") > " + to;
  return sort + " " + file + " > " + to;
}

bool are_sorted(const std::string& path) {
  std::optional<PointXy> last;
  bool sorted = true;
  each_point(path, [&](double x, double y) {
    if (last && (y > last->y || (y == last->y && x < last->x))) sorted = false;
    last = PointXy{x, y};
  });
  return sorted && last.has_value();
}

bool each_point(const std::string& path, const std::function<void(double x, double y)>& see) {
  const Columns columns = columns_of(path);
  std::ifstream file(path, std::ios::binary);
  for (std::string line; std::getline(file, line);)
    if (const auto point = point_of(line, columns)) see(point->x, point->y);
  return file.eof();
}

proto::Result<std::optional<std::string>> names_for_gdal(std::string_view head, const std::string& name) {
  const std::string_view line = first_line(head),
                         second = first_line(head.substr(std::min(head.find('\n'), head.size() - 1) + 1));
  std::string_view rest = line;
  const auto is_text = [](unsigned char c) { return c >= ' ' || c == '\t'; };
  if (head.empty() || !std::all_of(line.begin(), line.end(), is_text) || next_number(rest)) return std::optional<std::string>();
  const char separator = separator_of(line);
  const std::vector<std::string> words = words_of(uncommented(line), separator == ' ' ? " \t" : std::string_view(&separator, 1));
  NamedColumns columns = named(words);
  // Of three columns two say what the third one is; of names in other words the order counts.
  if (columns.z == 0 && words.size() == 3 && columns.x > 0 && columns.y > 0) columns.z = 6 - columns.x - columns.y;
  const bool known = columns.x > 0 || columns.y > 0 || columns.z > 0;
  const bool stays = columns.all() ? columns == named_for_gdal(line) : words.size() <= 3;
  if (!known || stays || !has_numbers(second, words.size())) return std::optional<std::string>();
  if (!columns.all()) {
    const std::string missing = columns.z == 0 ? "heights" : columns.x == 0 ? "x or longitudes" : "y or latitudes";
    return proto::Problem{
        "raster-format-unsupported",
        name + " has points whose first line names no column of " + missing + ": " + proto::shown_text(std::string(line), 60),
        "columns called x, y and z, such as \"x y z\" or \"longitude,latitude,elevation\" in the first line", ""};
  }
  std::string names;
  for (std::size_t k = 1; k <= words.size(); ++k) {
    names += k == 1 ? "" : std::string(1, separator);
    names += k == columns.x ? "x" : k == columns.y ? "y" : k == columns.z ? "z" : "c";
  }
  return std::optional(names);
}

}  // namespace cordillera::raster
