#include "raster/open/point_lines.h"

#include <charconv>
#include <fstream>
#include <optional>
#include <string_view>

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

}  // namespace

bool are_sorted(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::optional<PointXy> last;
  for (std::string text; std::getline(file, text);) {
    std::string_view line = text;
    const auto x = next_number(line), y = next_number(line);
    if (!x || !y) continue;
    if (last && (*y > last->y || (*y == last->y && *x < last->x))) return false;
    last = PointXy{*x, *y};
  }
  return last.has_value();
}

}  // namespace cordillera::raster
