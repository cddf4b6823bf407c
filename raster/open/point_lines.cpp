#include "raster/open/point_lines.h"

#include <algorithm>
#include <array>
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

/// What ends a column.
std::string_view ends_of(const char& separator) {
  return separator == ' ' ? std::string_view(" \t") : std::string_view(&separator, 1);
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

/// What is called by the word itself goes before what begins with it, as "height" before "height_error". Of several that begin
/// with it nobody knows which is meant.
class ColumnOf {
 public:
  void see(std::size_t number, bool is_word, bool begins) {
    if (is_word && word_ == 0) word_ = number;
    if (begins) begins_ = begins_ == 0 ? number : kSeveral;
  }
  std::size_t number() const { return word_ > 0 ? word_ : begins_ == kSeveral ? 0 : begins_; }

 private:
  static constexpr std::size_t kSeveral = SIZE_MAX;
  std::size_t word_ = 0, begins_ = 0;
};

/// Whether a line's words are names of columns by themselves, or may be words about anything.
enum class Line : bool { names, comment };

/// As people name them, with a unit in brackets or without.
NamedColumns named(const std::vector<std::string>& words, Line line) {
  const bool names = line == Line::names;
  ColumnOf x, y, z;
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string word = proto::lower(words[k]), bare = word.substr(0, word.find_first_of(" (["));
    x.see(k + 1, bare == "x" || bare == "lon" || bare == "longitude" || bare == "easting",
          names && begins_with_any(word, {"lon", "east"}));
    y.see(k + 1, bare == "y" || bare == "lat" || bare == "latitude" || bare == "northing",
          names && begins_with_any(word, {"lat", "north"}));
    z.see(k + 1, names_heights(bare), names && begins_with_any(word, {"elev", "alt", "height"}));
  }
  return {x.number(), y.number(), z.number()};
}

/// As GDAL's driver finds them: it parts words at blanks, too, and the last of several counts.
NamedColumns named_for_gdal(std::string_view line) {
  constexpr std::size_t kLongest = 100;  // that it reads
  NamedColumns found;
  const auto takes = [](char c) { return proto::is_letter_or_digit(c, " \t.,;+-\""); };  // it opens no other text
  if (line.size() > kLongest || !std::all_of(line.begin(), line.end(), takes)) return found;
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

/// The first line of points that have one.
struct NamesLine {
  char separator = ' ';
  bool comment = false;
  std::vector<std::string> words;
  NamedColumns columns;
};

NamesLine names_in(std::string_view line) {
  NamesLine header;
  const std::string_view names = uncommented(line);
  header.separator = separator_of(line);
  header.comment = names.size() < line.size();
  header.words = words_of(names, ends_of(header.separator));
  header.columns = named(header.words, header.comment ? Line::comment : Line::names);
  return header;
}

/// Whether a line has so many columns, and numbers in three of them at least.
bool has_numbers(std::string_view line, std::size_t columns) {
  const char separator = separator_of(line);
  const std::vector<std::string> words = words_of(line, ends_of(separator));
  std::size_t numbers = 0;
  for (const std::string& word : words) {
    std::string_view rest = word;
    numbers += next_number(rest) ? 1 : 0;
  }
  return words.size() == columns && numbers >= 3;
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
  const NamedColumns found = names_in(first_line(first)).columns;
  if (found.x > 0 && found.y > 0) columns.x = found.x, columns.y = found.y;
  return columns;
}

/// What stands in a column, which may be nothing.
std::string_view field(std::string_view line, char separator, std::size_t number) {
  const std::string_view ends = ends_of(separator);
  for (;; --number) {
    if (separator == ' ') line.remove_prefix(std::min(line.find_first_not_of(ends), line.size()));
    const std::size_t end = std::min(line.find_first_of(ends), line.size());
    if (number == 1) return line.substr(0, end);
    if (end == line.size()) return {};
    line.remove_prefix(end + 1);
  }
}

/// The numbers of a line that are x and y, if it has them.
std::optional<PointXy> point_of(std::string_view line, const Columns& columns) {
  std::string_view of_x = field(line, columns.separator, columns.x), of_y = field(line, columns.separator, columns.y);
  const auto x = next_number(of_x), y = next_number(of_y);
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
    return sorted;
  });
  return sorted && last.has_value();
}

bool each_point(const std::string& path, const std::function<bool(double x, double y)>& see) {
  const Columns columns = columns_of(path);
  std::ifstream file(path, std::ios::binary);
  bool first = true, all = true;
  for (std::string line; std::getline(file, line); first = false) {
    const auto point = point_of(line, columns);
    if (point && !see(point->x, point->y)) return false;
    const bool may_be_none = (first && columns.named) || line.find_first_not_of(" \t\r") == line.npos;
    all = all && (point || may_be_none);
  }
  return all && file.eof();
}

proto::Result<std::optional<std::string>> names_for_gdal(std::string_view head, const std::string& name) {
  const std::string_view line = first_line(head),
                         second = first_line(head.substr(std::min(head.find('\n'), head.size() - 1) + 1));
  std::string_view rest = line;
  const auto is_text = [](unsigned char c) { return c >= ' ' || c == '\t'; };
  constexpr std::array<std::string_view, 7> kTexts{"", ".xyz", ".txt", ".csv", ".tsv", ".pts", ".asc"};
  const std::string extension = extension_of(name);  // others have drivers of their own
  const bool may_be_points = std::find(kTexts.begin(), kTexts.end(), extension) != kTexts.end();
  if (head.empty() || !may_be_points || !std::all_of(line.begin(), line.end(), is_text) || next_number(rest))
    return std::optional<std::string>();
  const NamesLine header = names_in(line);
  const std::vector<std::string>& words = header.words;
  NamedColumns columns = header.columns;
  // Of three columns two say what the third one is; of names in other words the order counts.
  if (columns.z == 0 && words.size() == 3 && columns.x > 0 && columns.y > 0) columns.z = 6 - columns.x - columns.y;
  const bool known = columns.x > 0 || columns.y > 0 || columns.z > 0;
  const bool stays = columns.all() ? columns == named_for_gdal(line) : words.size() <= 3;
  if (!known || stays || (header.comment && !columns.all()) || !has_numbers(second, words.size()))
    return std::optional<std::string>();
  if (!columns.all()) {
    const std::string missing = columns.z == 0 ? "heights" : columns.x == 0 ? "x or longitudes" : "y or latitudes";
    return proto::Problem{
        "raster-format-unsupported",
        name + " has points whose first line names no column of " + missing + ": " + proto::shown_text(std::string(line), 60),
        "columns called x, y and z, such as \"x y z\" or \"longitude,latitude,elevation\" in the first line", ""};
  }
  std::string names;
  for (std::size_t k = 1; k <= words.size(); ++k) {
    names += k == 1 ? "" : std::string(1, header.separator);
    names += k == columns.x ? "x" : k == columns.y ? "y" : k == columns.z ? "z" : "c";
  }
  return std::optional(names);
}

}  // namespace cordillera::raster
