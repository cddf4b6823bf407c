#pragma once
// A run as words: "strategy=cleap window=512 collapses=400000 metric=qem".
#include <cstdio>
#include <cstdlib>
#include <map>
#include <sstream>
#include <string>

#include "gpu/cleap/cleap.h"

namespace cordillera::bench {

class Spec {
 public:
  explicit Spec(const std::string& words) {
    std::istringstream in(words);
    for (std::string word; in >> word;) {
      const std::size_t sign = word.find('=');
      if (sign == std::string::npos) fail(word + " is not name=value");
      values_[word.substr(0, sign)] = word.substr(sign + 1);
    }
  }
  std::string text(const std::string& name, const std::string& otherwise) const {
    const auto found = values_.find(name);
    return found == values_.end() ? otherwise : found->second;
  }
  double number(const std::string& name, double otherwise) const {
    const auto found = values_.find(name);
    return found == values_.end() ? otherwise : std::atof(found->second.c_str());
  }
  bool has(const std::string& name) const { return values_.contains(name); }
  const std::map<std::string, std::string>& values() const { return values_; }

  template <class T>
  void choose(const std::string& name, const std::map<std::string, T>& choices, T& into) const {
    if (!has(name)) return;
    const auto found = choices.find(values_.at(name));
    if (found == choices.end()) fail(name + "=" + values_.at(name) + " is not known");
    into = found->second;
  }
  [[noreturn]] static void fail(const std::string& what) {
    std::fprintf(stderr, "%s\n", what.c_str());
    std::exit(2);
  }

 private:
  std::map<std::string, std::string> values_;
};

inline gpu::cleap::Options options_of(const Spec& spec) {
  using namespace gpu::cleap;
  Options options;
  options.metric = spec.text("metric", options.metric);
  options.pool = spec.number("pool", options.pool);
  options.window = static_cast<std::uint32_t>(spec.number("window", options.window));
  options.seed = static_cast<std::uint64_t>(spec.number("seed", 1));
  options.most_triangles = static_cast<std::int32_t>(spec.number("c", options.most_triangles));
  options.most_passes = static_cast<std::uint32_t>(spec.number("passes", options.most_passes));
  options.around_first = static_cast<std::uint64_t>(spec.number("around_first", 0));
  options.come_back = spec.number("come_back", 0) != 0;
  options.closing = spec.number("closing", 0) != 0;
  options.time_phases = spec.number("phases", 0) != 0;
  options.each_window = spec.number("each_window", 0) != 0;
  spec.choose<Selection>("selection",
                         {{"sort", Selection::sort},
                          {"histogram", Selection::histogram},
                          {"unsorted", Selection::unsorted},
                          {"vertex-best", Selection::vertex_best},
                          {"super-independent", Selection::super_independent}},
                         options.selection);
  spec.choose<Shuffle>("shuffle", {{"fisher-yates", Shuffle::fisher_yates}, {"keyed", Shuffle::keyed}, {"none", Shuffle::none}},
                       options.shuffle);
  spec.choose<Lock>("lock", {{"ordered", Lock::ordered}, {"raced", Lock::raced}}, options.lock);
  spec.choose<Order>("order", {{"lock-first", Order::lock_first}, {"test-first", Order::test_first}}, options.order);
  spec.choose<Repair>("repair", {{"everywhere", Repair::everywhere}, {"around", Repair::around}}, options.repair);
  spec.choose<Rearrange>("rearrange", {{"scan", Rearrange::scan}, {"pointers", Rearrange::pointers}}, options.rearrange);
  spec.choose<Delaunay>("delaunay", {{"none", Delaunay::none}, {"at-end", Delaunay::at_end}, {"between", Delaunay::between}},
                        options.delaunay);
  spec.choose<Inversion>("inversion", {{"sign", Inversion::sign}, {"normals", Inversion::normals}}, options.inversion);
  spec.choose<Border>("border", {{"keep", Border::keep}, {"collapse", Border::collapse}}, options.border);
  return options;
}

}  // namespace cordillera::bench
