#include "raster/open/point_lines.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>

#include "proto/letters.h"
#include "raster/gdal/formats.h"

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

Columns columns_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string first;
  std::getline(file, first);
  Columns columns;
  for (const char separator : {';', ','})
    if (first.find(separator) != first.npos && columns.separator == ' ') columns.separator = separator;
  std::string_view line = first;
  columns.named = !next_number(line);
  if (!columns.named) return columns;
  std::string words = proto::lower(first);
  std::replace_if(
      words.begin(), words.end(), [](char c) { return c == ';' || c == ',' || c == '"'; }, ' ');
  std::istringstream names(words);
  std::size_t number = 1;
  std::optional<std::size_t> x, y;
  for (std::string name; names >> name; ++number) {
    if (!x && (name == "x" || name.starts_with("lon") || name.starts_with("east"))) x = number;
    if (!y && (name == "y" || name.starts_with("lat") || name.starts_with("north"))) y = number;
  }
  if (x && y) columns.x = *x, columns.y = *y;
  return columns;
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
  const Columns columns = columns_of(path);
  std::ifstream file(path, std::ios::binary);
  std::optional<PointXy> last;
  for (std::string text; std::getline(file, text);) {
    std::string_view line = text;
    std::optional<double> x, y;
    for (std::size_t k = 1; k <= std::max(columns.x, columns.y); ++k) {
      const auto value = next_number(line);
      if (k == columns.x) x = value;
      if (k == columns.y) y = value;
    }
    if (!x || !y) continue;
    if (last && (*y > last->y || (*y == last->y && *x < last->x))) return false;
    last = PointXy{*x, *y};
  }
  return last.has_value();
}

}  // namespace cordillera::raster
