#pragma once
#include <cstdio>
#include <string>

namespace cordillera::raster {

/// A raster's value as a person would write it: "-9999", "0.5", nine digits at most.
inline std::string short_number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

}  // namespace cordillera::raster
