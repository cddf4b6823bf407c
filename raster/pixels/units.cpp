#include "raster/pixels/units.h"

#include <array>
#include <string_view>

#include "proto/letters.h"

namespace cordillera::raster {
namespace {

struct Spelling {
  std::string_view text;  ///< lower case, letters only
  std::string_view name;
  double metres;
};

constexpr double kUsSurveyFoot_m = 1200.0 / 3937.0;

constexpr std::array kSpellings{
    Spelling{"m", "metre", 1},
    Spelling{"metre", "metre", 1},
    Spelling{"meter", "metre", 1},
    Spelling{"mt", "metre", 1},
    Spelling{"mtr", "metre", 1},
    Spelling{"meterm", "metre", 1},
    Spelling{"metrem", "metre", 1},
    Spelling{"ft", "foot", 0.3048},
    Spelling{"foot", "foot", 0.3048},
    Spelling{"feet", "foot", 0.3048},
    Spelling{"internationalfoot", "foot", 0.3048},
    Spelling{"internationalfeet", "foot", 0.3048},
    Spelling{"footinternational", "foot", 0.3048},
    Spelling{"intft", "foot", 0.3048},
    Spelling{"ift", "foot", 0.3048},
    Spelling{"footintl", "foot", 0.3048},
    Spelling{"feetintl", "foot", 0.3048},
    Spelling{"ussurveyfoot", "US survey foot", kUsSurveyFoot_m},
    Spelling{"ussurveyfeet", "US survey foot", kUsSurveyFoot_m},
    Spelling{"surveyfoot", "US survey foot", kUsSurveyFoot_m},
    Spelling{"surveyfeet", "US survey foot", kUsSurveyFoot_m},
    Spelling{"footus", "US survey foot", kUsSurveyFoot_m},
    Spelling{"feetus", "US survey foot", kUsSurveyFoot_m},
    Spelling{"usft", "US survey foot", kUsSurveyFoot_m},
    Spelling{"ftus", "US survey foot", kUsSurveyFoot_m},
    Spelling{"usfoot", "US survey foot", kUsSurveyFoot_m},
    Spelling{"usfeet", "US survey foot", kUsSurveyFoot_m},
    Spelling{"ussft", "US survey foot", kUsSurveyFoot_m},
    Spelling{"sft", "US survey foot", kUsSurveyFoot_m},
    Spelling{"footussurvey", "US survey foot", kUsSurveyFoot_m},
    Spelling{"feetussurvey", "US survey foot", kUsSurveyFoot_m},
    Spelling{"km", "kilometre", 1000},
    Spelling{"kilometre", "kilometre", 1000},
    Spelling{"kilometer", "kilometre", 1000},
    Spelling{"dm", "decimetre", 0.1},
    Spelling{"decimetre", "decimetre", 0.1},
    Spelling{"decimeter", "decimetre", 0.1},
    Spelling{"cm", "centimetre", 0.01},
    Spelling{"centimetre", "centimetre", 0.01},
    Spelling{"centimeter", "centimetre", 0.01},
    Spelling{"mm", "millimetre", 0.001},
    Spelling{"millimetre", "millimetre", 0.001},
    Spelling{"millimeter", "millimetre", 0.001},
    Spelling{"fathom", "fathom", 1.8288},
};

}  // namespace

std::optional<HeightUnit> height_unit(const std::string& text) {
  std::string letters;
  for (const char c : text)
    if (proto::is_letter(c)) letters += proto::lower(c);
  for (int plural = 0; plural < 2; ++plural) {
    for (const Spelling& s : kSpellings)
      if (s.text == letters) return HeightUnit{std::string(s.name), s.metres};
    if (letters.size() < 3 || letters.back() != 's') break;
    letters.pop_back();
  }
  return std::nullopt;
}

}  // namespace cordillera::raster
