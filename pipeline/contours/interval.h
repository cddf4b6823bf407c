#pragma once
// From line to line: what a zoom has, what ?interval= may ask for, and which lines are drawn thicker.
#include <cstdint>
#include <string_view>

#include "proto/result.h"

namespace cordillera::pipeline::contours {

/// What ?interval= accepts, for the API's description and for refusals.
inline constexpr std::string_view kIntervals =
    "metres, 1 to 5000, with up to three decimals (12.192 is 40 feet); "
    "a zoom whose least interval is greater takes a multiple: 2, 5, 10, 20, …";

/// Millimetres: whole numbers, so that a line's height is one number everywhere.
struct Interval {
  std::int32_t mm = 0;
};

/// Of a zoom, unless the query has another. relief_m: between the lowest and the highest ground of the dataset. Flat ground has
/// closer lines, at least five from its lowest to its highest, as far as the zoom allows.
Interval usual_interval(int zoom, double relief_m);
/// A quarter or a fifth of what mountains have: closer lines would lie on each other.
Interval least_interval(int zoom);

/// What interval= says, before any zoom; the text must not be empty. A problem where it is none.
proto::Result<Interval> interval_asked(std::string_view text);
/// What a zoom makes of it: the least of 1, 2, 5, 10, 20, … times as much that the zoom allows.
Interval at_zoom(Interval asked, int zoom);
/// The next of these: 1, 2, 5, 10, … for 0, 1, 2, 3, …
std::int32_t multiple(int step);

/// The greatest of 1, 2, 5 and 10 that a line's number, its height in intervals, is a multiple of.
int index_of(std::int64_t number);

}  // namespace cordillera::pipeline::contours
