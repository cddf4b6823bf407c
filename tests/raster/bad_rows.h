#pragma once
// Inputs that are broken, hostile or absurd, made from good files: the rows of the table of bad inputs.
#include <functional>
#include <string>
#include <vector>

#include "fixture.h"

namespace cordillera::raster_test {

struct BadRow {
  std::string name;  ///< of the row: says what was done to which file
  std::string file;  ///< what the user calls the raster
  std::string bytes;
  proto::BuildOptions options = plain_options();
};

/// Writes a Spec and gives its bytes.
using Maker = std::function<std::string(const Spec& spec, const std::string& name)>;

std::vector<BadRow> cut_rows(const Maker& make);
/// Of formats that are sent with side files, in archives or as text.
std::vector<BadRow> sent_bad_rows();
std::vector<BadRow> tag_rows(const Maker& make);
std::vector<BadRow> size_rows(const Maker& make);
std::vector<BadRow> place_rows(const Maker& make);
std::vector<BadRow> text_rows();

}  // namespace cordillera::raster_test
