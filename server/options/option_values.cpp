#include "server/options/option_values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "proto/letters.h"
#include "proto/numbers.h"
#include "proto/utf8.h"

namespace cordillera::server {
namespace {

/// Letters put in, left out, changed, or two neighbours exchanged, to make one word of the other.
std::size_t edits_between(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before, last, row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before = std::exchange(last, row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1), last[j] + 1, row[j - 1] + 1});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row.back();
}

/// A list as other programs write it: "7 46 8 47" and "[7, 46, 8, 47]" are 7,46,8,47.
std::string comma_list(std::string_view text) {
  if (text.size() > 2 && text.front() == '[' && text.back() == ']') text = proto::trimmed(text.substr(1, text.size() - 2));
  std::string list(text);
  if (list.find(',') == list.npos)
    for (std::size_t at = 0; (at = list.find_first_of(" \t", at)) != list.npos;)
      list.replace(at, std::min(list.find_first_not_of(" \t", at), list.size()) - at, ",");
  return list;
}

}  // namespace

std::string shown(double value) {
  char buffer[400];  // the greatest double has 309 digits
  const auto format = std::abs(value) > 1e15 ? std::chars_format::general : std::chars_format::fixed;
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, format).ptr;
  return std::string(buffer, end);
}

Complaint read_number(std::string_view text, NumberRange range, double* out) {
  const auto value = proto::signed_number<double>(proto::trimmed(text));
  if (!value || !std::isfinite(*value)) return "not a number";
  if (*value < range.least || *value > range.greatest) return "outside " + shown(range.least) + " to " + shown(range.greatest);
  *out = *value;
  return std::nullopt;
}

Complaint read_whole(std::string_view text, WholeRange range, std::uint32_t* out) {
  const auto value = proto::signed_number<std::int64_t>(proto::trimmed(text));
  if (!value) return "not a whole number";
  if (*value < range.least || *value > range.greatest)
    return "outside " + std::to_string(range.least) + " to " + std::to_string(range.greatest);
  *out = static_cast<std::uint32_t>(*value);
  return std::nullopt;
}

std::string accepted_in(WholeRange range) { return std::to_string(range.least) + " to " + std::to_string(range.greatest); }

Complaint read_numbers(std::string_view text, NumberRange range, std::vector<double>* out) {
  std::vector<double> values;
  while (true) {
    const auto comma = text.find(',');
    double value = 0;
    if (auto complaint = read_number(text.substr(0, comma), range, &value)) {
      return "number " + std::to_string(values.size() + 1) + ": " + *complaint;
    }
    values.push_back(value);
    if (comma == std::string_view::npos) break;
    text.remove_prefix(comma + 1);
  }
  *out = std::move(values);
  return std::nullopt;
}

Complaint read_box(std::string_view text, std::array<double, 4>* out) {
  std::vector<double> box;
  constexpr double kAny = std::numeric_limits<double>::max();  // each is looked at below, by what it is
  if (auto complaint = read_numbers(comma_list(proto::trimmed(text)), {-kAny, kAny}, &box)) return complaint;
  if (box.size() != 4) return std::to_string(box.size()) + " numbers instead of 4";
  // What other programs take, named in the order that is wanted here: latitude first, or gdal_translate's upper left corner
  // first.
  const auto in_order = [](double west, double south, double east, double north) {
    return "; in the order west,south,east,north it may be " + shown(west) + "," + shown(south) + "," + shown(east) + "," +
           shown(north);
  };
  if (std::abs(box[1]) > 90 || std::abs(box[3]) > 90) {
    const bool turned = std::abs(box[0]) <= 90 && std::abs(box[2]) <= 90 && box[0] < box[2];
    return "a latitude is beyond a pole" + (turned ? in_order(box[1], box[0], box[3], box[2]) : "");
  }
  if (box[1] > box[3]) {
    // Both corners may be turned. A box over the antimeridian is left as it is: it is the narrower of the two that the longitudes
    // can mean.
    const bool turned = box[0] > box[2] && box[0] - box[2] < 180;
    return "south is not below north" + in_order(turned ? box[2] : box[0], box[3], turned ? box[0] : box[2], box[1]);
  }
  if (box[1] == box[3]) return "south equals north";
  if (std::abs(box[0]) > 180 || std::abs(box[2]) > 180) return "a longitude is outside -180 to 180";
  if (box[0] == box[2]) return "west equals east";
  *out = {box[0], box[1], box[2], box[3]};
  return std::nullopt;
}

Complaint read_choice(std::string_view text, const std::vector<std::string>& choices, std::string* out) {
  for (const std::string& choice : choices) {
    if (proto::lower(choice) == proto::lower(proto::trimmed(text))) {
      *out = choice;
      return std::nullopt;
    }
  }
  const auto nearest = nearest_name(text, choices);
  return nearest ? "no such choice; did you mean " + *nearest + "?" : Complaint("no such choice");
}

Complaint read_switch(std::string_view text, bool* out) {
  const std::string word = proto::lower(proto::trimmed(text));
  const std::vector<std::string> on = {"", "1", "true", "yes", "on"}, off = {"0", "false", "no", "off"};
  if (std::find(on.begin(), on.end(), word) != on.end()) {
    *out = true;
  } else if (std::find(off.begin(), off.end(), word) != off.end()) {
    *out = false;
  } else {
    return "neither yes nor no";
  }
  return std::nullopt;
}

Complaint read_text(std::string_view text, std::string* out) {
  if (text.size() > 1000) return "longer than 1000 bytes";
  if (!is_utf8(text)) return "not UTF-8";
  if (proto::has_control(text)) return "contains a control character";
  *out = std::string(text);
  return std::nullopt;
}

Complaint read_imagery(std::string_view text, std::string* out) {
  std::string plain;
  if (auto complaint = read_text(text, &plain)) return complaint;
  if (!plain.starts_with("https://") && !plain.starts_with("http://")) return "no address of http or https";
  for (const char* name : {"{z}", "{x}", "{y}"}) {
    const auto at = plain.find(name);
    if (at == std::string::npos || plain.find(name, at + 1) != std::string::npos)
      return std::string("it does not have ") + name + " once";
  }
  const std::size_t host = plain.find("://") + 3;
  if (plain.substr(host, plain.find_first_of("/?#", host) - host).find('@') != plain.npos)
    return "it has a user's name in front of its host";
  std::string rest = plain;
  for (const char* name : {"{z}", "{x}", "{y}"}) rest.erase(rest.find(name), 3);
  if (rest.find_first_of(" \"<>\\^`{|}'") != std::string::npos) return "it has a character that no address has";
  *out = plain;
  return std::nullopt;
}

Complaint read_device(std::string_view text, std::string* out) {
  const std::string word = proto::lower(proto::trimmed(text));
  std::uint32_t index = 0;
  const bool numbered = word.rfind("cuda:", 0) == 0 && !read_whole(word.substr(5), {0, 255}, &index);
  if (word != "auto" && word != "cpu" && word != "cuda" && !numbered) return "no such device";
  *out = numbered ? "cuda:" + std::to_string(index) : word;
  return std::nullopt;
}

bool is_utf8(std::string_view text) { return proto::is_utf8(text); }

std::optional<std::string> nearest_name(std::string_view name, const std::vector<std::string>& candidates) {
  const std::string wanted = proto::lower(name.substr(0, 64));
  std::optional<std::string> best;
  std::size_t best_distance = std::max<std::size_t>(1, wanted.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edits_between(wanted, proto::lower(candidate));
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string quotable(const std::string& text, std::size_t most) { return is_utf8(text) ? text.substr(0, most) : "(not UTF-8)"; }

proto::Problem wrong_value(const std::string& name, const std::string& value, const std::string& complaint,
                           const std::string& accepted) {
  return {"option-invalid", name + "='" + quotable(value, 200) + "': " + complaint, accepted, name};
}

}  // namespace cordillera::server
