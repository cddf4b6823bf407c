#pragma once
// The text format of Prometheus, version 0.0.4, read more strictly than Prometheus does: whatever is not exactly so is told.
// https://prometheus.io/docs/instrumenting/exposition_formats/
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace cordillera::server {

struct Sample {
  std::string name;  ///< with _bucket, _sum or _count
  std::map<std::string, std::string> labels;
  double value = 0;
};

struct PrometheusText {
  std::map<std::string, std::string> types;  ///< by family
  std::vector<Sample> samples;
  std::vector<std::string> wrong;  ///< sentences

  /// Of a family: all whose labels hold these.
  double sum(const std::string& name, const std::map<std::string, std::string>& wanted = {}) const {
    double all = 0;
    for (const Sample& sample : samples) {
      if (sample.name != name) continue;
      bool fits = true;
      for (const auto& [label, value] : wanted)
        fits = fits && sample.labels.count(label) != 0 && sample.labels.at(label) == value;
      if (fits) all += sample.value;
    }
    return all;
  }
};

/// The family that a sample's name belongs to; empty: to none that was declared.
inline std::string family_of(const PrometheusText& text, const std::string& name) {
  if (const auto type = text.types.find(name); type != text.types.end()) return type->second == "histogram" ? "" : name;
  for (const std::string suffix : {"_bucket", "_sum", "_count"}) {
    if (name.size() <= suffix.size() || name.compare(name.size() - suffix.size(), suffix.size(), suffix) != 0) continue;
    const std::string base = name.substr(0, name.size() - suffix.size());
    const auto type = text.types.find(base);
    if (type != text.types.end() && type->second == "histogram") return base;
  }
  return "";
}

inline void read_labels(PrometheusText& text, Sample& sample, const std::string& labels) {
  static const std::regex kLabel(R"re(([a-zA-Z_][a-zA-Z0-9_]*)="((?:[^"\\\n]|\\["\\n])*)"(,|$))re");
  std::size_t read = 0;
  for (std::sregex_iterator at(labels.begin(), labels.end(), kLabel), end; at != end; ++at) {
    if (static_cast<std::size_t>(at->position()) != read) break;
    if (!sample.labels.emplace((*at)[1], (*at)[2]).second) text.wrong.push_back(sample.name + ": a label twice");
    read += static_cast<std::size_t>(at->length());
  }
  if (read != labels.size() || (!labels.empty() && labels.back() == ','))
    text.wrong.push_back(sample.name + ": labels {" + labels + "}");
}

inline void read_sample(PrometheusText& text, const std::string& line, const std::string& family) {
  static const std::regex kSample(
      R"re(([a-zA-Z_:][a-zA-Z0-9_:]*)(?:\{(.+)\})? (-?[0-9]+(?:\.[0-9]+)?(?:e[+-]?[0-9]+)?|[+-]Inf|NaN))re");
  std::smatch parts;
  if (!std::regex_match(line, parts, kSample)) return text.wrong.push_back("no sample: " + line);
  Sample sample{parts[1], {}, std::strtod(parts[3].str().c_str(), nullptr)};
  read_labels(text, sample, parts[2]);
  if (family.empty() || family_of(text, sample.name) != family)
    text.wrong.push_back(sample.name + " does not stand below its family's TYPE");
  if (text.types[family] == "counter" && !(sample.value >= 0)) text.wrong.push_back(sample.name + ": a counter below 0");
  for (const Sample& other : text.samples) {
    if (other.name == sample.name && other.labels == sample.labels) text.wrong.push_back(line + ": given twice");
  }
  text.samples.push_back(std::move(sample));
}

/// Buckets of one histogram rise to +Inf, which is the count.
inline void check_histograms(PrometheusText& text) {
  std::map<std::string, std::vector<std::pair<double, double>>> buckets;
  std::map<std::string, double> counts;
  std::set<std::string> sums;
  const auto key = [](const std::string& family, std::map<std::string, std::string> labels) {
    labels.erase("le");
    std::string all = family;
    for (const auto& [name, value] : labels) all += "," + name + "=" + value;
    return all;
  };
  for (const Sample& sample : text.samples) {
    const std::string family = family_of(text, sample.name);
    if (text.types[family] != "histogram") continue;
    const std::string at = key(family, sample.labels), part = sample.name.substr(family.size());
    if (part == "_bucket")
      buckets[at].emplace_back(sample.labels.count("le") ? std::strtod(sample.labels.at("le").c_str(), nullptr) : -1,
                               sample.value);
    if (part == "_count") counts[at] = sample.value;
    if (part == "_sum") sums.insert(at);
  }
  for (const auto& [at, spread] : buckets) {
    for (std::size_t i = 1; i < spread.size(); ++i) {
      if (spread[i].first <= spread[i - 1].first || spread[i].second < spread[i - 1].second)
        text.wrong.push_back(at + ": buckets do not rise");
    }
    if (spread.back().first < 1e300 || counts.count(at) == 0 || spread.back().second != counts[at])
      text.wrong.push_back(at + ": the last bucket is not +Inf and the count");
    if (sums.count(at) == 0) text.wrong.push_back(at + ": no sum");
  }
}

inline PrometheusText read_prometheus(const std::string& bytes) {
  static const std::regex kHelp(R"(# HELP ([a-zA-Z_:][a-zA-Z0-9_:]*) \S.*)"),
      kType(R"(# TYPE ([a-zA-Z_:][a-zA-Z0-9_:]*) (counter|gauge|histogram))");
  PrometheusText text;
  if (bytes.empty() || bytes.back() != '\n') text.wrong.push_back("the last line does not end");
  std::istringstream lines(bytes);
  std::string family, helped;
  std::smatch parts;
  for (std::string line; std::getline(lines, line);) {
    if (std::regex_match(line, parts, kHelp)) {
      helped = parts[1];
    } else if (std::regex_match(line, parts, kType)) {
      family = parts[1];
      if (helped != family) text.wrong.push_back(family + " has no HELP before its TYPE");
      if (!text.types.emplace(family, parts[2]).second) text.wrong.push_back(family + " is declared twice");
      const bool total = family.size() > 6 && family.compare(family.size() - 6, 6, "_total") == 0;
      if (total != (parts[2] == "counter")) text.wrong.push_back(family + ": counters, and they alone, end with _total");
    } else {
      read_sample(text, line, family);
    }
  }
  check_histograms(text);
  return text;
}

}  // namespace cordillera::server
