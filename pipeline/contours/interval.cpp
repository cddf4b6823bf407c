#include "pipeline/contours/interval.h"

#include <algorithm>
#include <array>
#include <string>

#include "proto/numbers.h"

namespace cordillera::pipeline::contours {
namespace {

constexpr std::int32_t kLeast_m = 1, kMost_m = 5000;

struct Row {
  std::int32_t usual_m, least_m;
};
/// Zooms 9 and coarser, 10, 11, … and 15 and finer. About a pixel of 256 a tile's side at the equator: ground that rises 45
/// degrees has a line a pixel, common ground one in five or ten.
constexpr int kFirst = 9;
constexpr std::array<Row, 7> kRows = {{{500, 100}, {200, 50}, {100, 20}, {50, 10}, {20, 5}, {10, 2}, {5, 1}}};

const Row& row_of(int zoom) {
  return kRows[static_cast<std::size_t>(std::clamp(zoom - kFirst, 0, static_cast<int>(kRows.size()) - 1))];
}

/// Digits, and up to three behind a point.
std::int64_t millimetres(std::string_view text) {
  const std::size_t point = text.find('.');
  std::string digits(text.substr(0, point));
  std::string_view behind = point == text.npos ? std::string_view() : text.substr(point + 1);
  if (digits.empty() || digits.size() > 4 || behind.size() > 3 || (point != text.npos && behind.empty())) return -1;
  digits.append(behind).append(3 - behind.size(), '0');
  return proto::number<std::int64_t>(digits).value_or(-1);
}

}  // namespace

Interval usual_interval(int zoom, double relief_m) {
  constexpr int kLines = 5;
  const Row& row = row_of(zoom);
  int step = 0;
  while (multiple(step) < row.usual_m && multiple(step + 1) * kLines <= relief_m) ++step;
  return {std::clamp(multiple(step), row.least_m, row.usual_m) * 1000};
}
Interval least_interval(int zoom) { return {row_of(zoom).least_m * 1000}; }

proto::Result<Interval> interval_asked(std::string_view text) {
  const std::int64_t mm = millimetres(text);
  if (mm < kLeast_m * 1000 || mm > kMost_m * 1000)
    return proto::Problem{"option-invalid", "interval=" + std::string(text.substr(0, 40)) + " is no interval of contours",
                          std::string(kIntervals), "interval"};
  return Interval{static_cast<std::int32_t>(mm)};
}

std::int32_t multiple(int step) {
  constexpr std::array<std::int32_t, 3> kSteps = {1, 2, 5};
  std::int32_t power = 1;
  for (int k = step / 3; k > 0; --k) power *= 10;
  return power * kSteps[static_cast<std::size_t>(step % 3)];
}

Interval at_zoom(Interval asked, int zoom) {
  int step = 0;
  while (asked.mm * multiple(step) < least_interval(zoom).mm) ++step;
  return {asked.mm * multiple(step)};
}

int index_of(std::int64_t number) {
  for (const int index : {10, 5, 2}) {
    if (number % index == 0) return index;
  }
  return 1;
}

}  // namespace cordillera::pipeline::contours
