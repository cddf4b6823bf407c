#pragma once
// Units of height, in the spellings found in files.
#include <optional>
#include <string>

namespace cordillera::raster {

struct HeightUnit {
  std::string name;  ///< metre, foot, US survey foot, kilometre, 0.1 metre, ...
  double metres = 1;
};

/// The unit a file means by text (any case, singular or plural, with or without punctuation), also with a factor before it:
/// "0.1 m". None when we do not know it.
std::optional<HeightUnit> height_unit(const std::string& text);

/// The spellings named in messages.
inline constexpr const char* kAcceptedUnits =
    "metre, foot, US survey foot, kilometre, decimetre, centimetre, millimetre, fathom, one of them with a factor (0.1 m)";

}  // namespace cordillera::raster
