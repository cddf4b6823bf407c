#include "server/metrics/family.h"

#include <algorithm>

#include "proto/numbers.h"

namespace cordillera::server::metrics {
namespace {

std::string escaped(std::string_view value) {
  std::string text;
  for (const char c : value) {
    if (c == '\\' || c == '"') text += '\\';
    text += c == '\n' ? std::string("\\n") : std::string(1, c);
  }
  return text;
}

}  // namespace

void Families::write(std::string& out) const {
  for (const Family* family : all_) family->write(out);
}

std::string Family::key(Labels values) const {
  std::string text;
  auto name = labels_.begin();
  for (const std::string_view value : values) {
    text.append(text.empty() ? "" : ",").append(*name++).append("=\"").append(escaped(value)).append("\"");
  }
  return text;
}

void Family::write_sample(std::string& out, const char* suffix, const std::string& labels, double value) const {
  out.append(name_).append(suffix);
  if (!labels.empty()) out.append("{").append(labels).append("}");
  out += ' ';
  proto::append_number(out, value);
  out += '\n';
}

void Family::write(std::string& out) const {
  out.append("# HELP ")
      .append(name_)
      .append(" ")
      .append(help_)
      .append("\n# TYPE ")
      .append(name_)
      .append(" ")
      .append(type_)
      .append("\n");
  const std::lock_guard lock(mutex_);
  write_samples(out);
}

Numbers::Value& Numbers::at(Labels labels) {
  std::string its = key(labels);
  const std::lock_guard lock(mutex_);
  return values_[std::move(its)];
}

void Numbers::write_samples(std::string& out) const {
  for (const auto& [labels, value] : values_) write_sample(out, "", labels, value);
}

// A family without labels has its one value from the start: a rate then sees the first event too.
Counter::Counter(Families& all, const char* name, const char* help, std::vector<const char*> labels)
    : Numbers(all, name, help, "counter", labels) {
  if (labels.empty()) set(0);
}

Gauge::Gauge(Families& all, const char* name, const char* help, std::vector<const char*> labels)
    : Numbers(all, name, help, "gauge", labels) {
  if (labels.empty()) set(0);
}

Histogram::Histogram(Families& all, const char* name, const char* help, std::vector<double> bounds,
                     std::vector<const char*> labels)
    : Family(all, name, help, "histogram", std::move(labels)), bounds_(std::move(bounds)) {}

void Histogram::Spread::observe(double value) {
  const auto bucket = std::lower_bound(bounds_.begin(), bounds_.end(), value) - bounds_.begin();
  counts_[static_cast<std::size_t>(bucket)] += 1;
  sum_ += value;
}

Histogram::Spread& Histogram::at(Labels labels) {
  std::string its = key(labels);
  const std::lock_guard lock(mutex_);
  return spreads_.try_emplace(std::move(its), bounds_).first->second;
}

void Histogram::write_samples(std::string& out) const {
  for (const auto& [labels, spread] : spreads_) {
    const std::string before = (labels.empty() ? "" : labels + ",") + "le=\"";
    double count = 0;
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
      count += spread.counts_[i];
      std::string bucket = before;
      proto::append_number(bucket, bounds_[i]);
      write_sample(out, "_bucket", bucket + "\"", count);
    }
    count += spread.counts_.back();
    write_sample(out, "_bucket", before + "+Inf\"", count);
    write_sample(out, "_sum", labels, spread.sum_);
    write_sample(out, "_count", labels, count);
  }
}

}  // namespace cordillera::server::metrics
