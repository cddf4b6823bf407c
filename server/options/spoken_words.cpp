#include "server/options/spoken_words.h"

#include <algorithm>
#include <set>
#include <string_view>

#include "proto/letters.h"
#include "raster/gdal/formats.h"
#include "server/options/mesh_options.h"
#include "server/options/option_values.h"
#include "server/options/options.h"

namespace cordillera::server {
namespace {

constexpr std::size_t kNumbersOfABox = 4;

/// A number, and a comma behind it as in "10, 46, 11, 47".
bool is_number(std::string word) {
  double value = 0;
  if (word.ends_with(',')) word.pop_back();
  return !read_number(word, {-1e9, 1e9}, &value);
}

std::string joined(const std::vector<std::string>& words, std::size_t first) {
  std::string text;
  for (std::size_t k = first; k < first + kNumbersOfABox; ++k) {
    std::string number = words[k];
    if (number.ends_with(',')) number.pop_back();
    text += (text.empty() ? "" : ",") + number;
  }
  return text;
}

}  // namespace

std::vector<std::string> understood(std::vector<std::string> words) {
  if (!words.empty() && words[0] == "help") {
    words.erase(words.begin());
    const auto all = std::find(words.begin(), words.end(), "--all");
    const bool in_full = all != words.end();
    if (in_full) words.erase(all);
    words.insert(words.size() > 0 ? words.begin() + 1 : words.begin(), in_full ? "--help-all" : "--help");
  }
  if (words.size() == 1 && (words[0] == "version" || words[0] == "-v" || words[0] == "-V")) words[0] = "--version";
  // The library would take what follows for words of no command, once the command has a word.
  const auto mark = std::find(words.begin(), words.end(), "--");
  const auto options = static_cast<std::size_t>(mark - words.begin());
  if (mark != words.end()) words.erase(mark);
  for (std::size_t k = options; k < words.size(); ++k) {
    if (words[k].size() > 1 && words[k][0] == '-') words[k] = "./" + words[k];
  }
  std::vector<std::string> out;
  for (std::size_t k = 0; k < words.size(); ++k) {
    out.push_back(words[k]);
    if (words[k] != "--bbox" || k + kNumbersOfABox >= words.size()) continue;
    bool numbers = true;
    for (std::size_t n = 1; n <= kNumbersOfABox; ++n) numbers = numbers && is_number(words[k + n]);
    if (!numbers) continue;
    out.push_back(joined(words, k + 1));
    k += kNumbersOfABox;
  }
  return out;
}

std::optional<std::string> meant_by_habit(std::string word) {
  struct Habit {
    std::string_view option, words;  ///< between blanks
  };
  static constexpr Habit kHabits[] = {
      {"source", " url file raster path "},
      {"crs", " epsg srs srid proj projection a-srs s-srs t-srs source-srs input-srs "},
      {"z-scale", " unit units vertical-unit vertical-units height-unit z-factor zfactor exaggeration vertical-exaggeration "},
      {"max-level", " zoom maxzoom max-zoom maxlevel max max-z resolution tr tile-depth tiledepth start-zoom zoom-level "},
      {"min-level", " minzoom min-zoom minlevel min min-z end-zoom "},
      {"error", " tolerance max-error maxerror accuracy geometric-error "},
      {"keep", " ratio reduce decimate "},
      {"bbox", " bounds extent te projwin clip aoi region box window "},
      {"nodata", " nodata-value no-data nodatavalue srcnodata src-nodata dstnodata a-nodata "},
      {"voids", " fill fill-voids fill-nodata fillnodata holes "},
      {"vertical-datum", " datum vdatum geoid vertical-crs vertical height-datum vertical-srs "},
      {"attribution", " copyright credit license "},
      {"threads", " cores cpus processes workers jobs "},
      {"listen", " bind address addr "},
      {"data", " data-dir datadir data-folder root store "},
      {"log-level", " verbose verbosity loglevel "},
      {"output", " out output-dir dest destination outdir "},
      {"formats", " output-format "},
      {"normals", " vertex-normals calculatenormals normal "},
  };
  word.erase(0, word.find_first_not_of('-'));
  word = proto::lower(word);
  std::replace(word.begin(), word.end(), '_', '-');
  for (const auto& [option, words] : kHabits) {
    if (!word.empty() && words.find(" " + word + " ") != words.npos) return std::string(option);
  }
  return std::nullopt;
}

/// Whether the word at `at` is the beginning of a file's name: "max_level.tif", "voids=hole.tif".
static bool is_name_of_file(const std::string& sentence, std::size_t at) {
  const std::size_t end = std::min(sentence.find_first_of(" ,;:)'\"", at), sentence.size());
  return raster::is_raster_extension(raster::extension_of(sentence.substr(at, end - at)));
}

std::string as_typed(const std::string& sentence) {
  static const std::set<std::string> kNames = [] {
    std::set<std::string> names;
    for (const OptionSpec& option : post_options())
      names.insert({spelt(option.name, Spelling::query), spelt(option.alias, Spelling::query)});
    for (const MeshOption& option : mesh_options()) names.insert(option.name);
    names.erase("");
    return names;
  }();
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz_";
  constexpr std::string_view kBefore =
      " (\"'";  // what a word begins behind: not an address, a path or an option that is spelt as typed already
  std::string out;
  bool quoted = false;  // between `: a line of another program
  for (std::size_t at = 0; at < sentence.size();) {
    if (sentence[at] == '`') quoted = !quoted;
    const bool begins = !quoted && (at == 0 || kBefore.find(sentence[at - 1]) != kBefore.npos);
    const std::size_t end = begins ? std::min(sentence.find_first_not_of(kLetters, at), sentence.size()) : at;
    const std::string word = sentence.substr(at, end - at);
    const bool set = end < sentence.size() && sentence[end] == '=';
    // Without its sign only what can be no other word: max_level, but not error.
    if (!kNames.contains(word) || !(set || word.find('_') != word.npos) || is_name_of_file(sentence, at)) {
      out += sentence.substr(at, std::max<std::size_t>(1, word.size()));
      at += std::max<std::size_t>(1, word.size());
      continue;
    }
    out += spelt(word, Spelling::command_line);
    std::replace(out.end() - static_cast<std::ptrdiff_t>(word.size()), out.end(), '_', '-');
    at = end;
    const bool valued =
        set && end + 1 < sentence.size() && std::string_view(" ,;.)").find(sentence[end + 1]) == std::string_view::npos;
    if (set && !valued) ++at;
  }
  return out;
}

std::string listen_address(const std::string& host, const std::string& port) {
  const std::string usual = ServeSettings().listen;
  const auto colon = usual.rfind(':');
  const bool bare = host.find(':') != host.npos && !host.starts_with('[');
  return (host.empty() ? usual.substr(0, colon)
          : bare       ? "[" + host + "]"
                       : host) +
         ":" + (port.empty() ? usual.substr(colon + 1) : port);
}

}  // namespace cordillera::server
