#include "raster/pixels/units.h"

#include <array>
#include <charconv>
#include <string_view>

#include "proto/letters.h"

namespace cordillera::raster {
namespace {

struct Spelling {
  std::string_view text;  ///< small letters only
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

/// What a name may hold between its letters and around them: "ft (US)", "Foot_US", "[m]", "m.".
constexpr std::string_view kPunctuation = " \t\r\n._-,;:()[]{}'\"";

/// Whether this is another unit than its letters alone would say: one that points down, a million metres, a square metre.
bool is_another(std::string_view name) {
  const std::string_view bare = proto::trimmed(name);
  return bare.starts_with('-') || bare == "Mm" || bare == "m m";
}

/// The unit of this name. None, too, where it holds a digit, a power or a quotient ("m2", "m/10"): it is another unit.
std::optional<HeightUnit> named_unit(std::string_view name) {
  if (is_another(name)) return std::nullopt;
  std::string letters;
  for (const char c : name) {
    if (proto::is_letter(c))
      letters += proto::lower(c);
    else if (kPunctuation.find(c) == kPunctuation.npos)
      return std::nullopt;
  }
  for (int plural = 0; plural < 2; ++plural) {
    for (const Spelling& s : kSpellings)
      if (s.text == letters) return HeightUnit{std::string(s.name), s.metres};
    if (letters.size() < 3 || letters.back() != 's') break;
    letters.pop_back();
  }
  return std::nullopt;
}

}  // namespace

std::optional<HeightUnit> height_unit(const std::string& text) {
  const std::string_view whole = proto::trimmed(text, " \t\r\n([{'\"");
  const std::string_view first_digit = whole.starts_with('.') ? whole.substr(1) : whole;
  if (first_digit.empty() || !proto::is_digit(first_digit.front())) return named_unit(whole);
  double factor = 0;
  const auto [end, error] = std::from_chars(whole.data(), whole.data() + whole.size(), factor);
  if (error != std::errc() || !(factor > 0)) return std::nullopt;
  const auto digits = static_cast<std::size_t>(end - whole.data());
  auto unit = named_unit(whole.substr(digits));
  if (!unit || factor == 1) return unit;
  return HeightUnit{std::string(whole.substr(0, digits)) + " " + unit->name, factor * unit->metres};
}

}  // namespace cordillera::raster
