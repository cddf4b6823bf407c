#pragma once
// Numbers that only grow, that go up and down, and spreads of durations, as Prometheus reads them (text format 0.0.4). A family
// is a metric with all values of its labels. Labels come from our own tables, never from what clients send: there are few.
#include <atomic>
#include <initializer_list>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace cordillera::server::metrics {

/// Values of the labels, in the order of their names.
using Labels = std::initializer_list<std::string_view>;

class Family;

/// All families of a service, in the order in which they were made: each enters itself. It must live as long as they do.
class Families {
 public:
  /// Appends the lines of all.
  void write(std::string& out) const;

 private:
  friend class Family;
  std::vector<const Family*> all_;
};

class Family {
 public:
  Family(Families& all, const char* name, const char* help, const char* type, std::vector<const char*> labels)
      : name_(name), help_(help), type_(type), labels_(std::move(labels)) {
    all.all_.push_back(this);
  }
  virtual ~Family() = default;
  Family(const Family&) = delete;
  Family& operator=(const Family&) = delete;
  /// Appends the family's lines.
  void write(std::string& out) const;

 protected:
  /// label="value",… without braces.
  std::string key(Labels values) const;
  virtual void write_samples(std::string& out) const = 0;
  void write_sample(std::string& out, const char* suffix, const std::string& labels, double value) const;

  mutable std::mutex mutex_;

 private:
  const char* name_;
  const char* help_;
  const char* type_;
  const std::vector<const char*> labels_;
};

/// Counters and gauges.
class Numbers : public Family {
 public:
  using Family::Family;
  /// One of its values, which lives as long as the family: for who counts often, without looking its labels up.
  using Value = std::atomic<double>;
  Value& at(Labels labels);
  void add(double by, Labels labels = {}) { at(labels) += by; }
  void set(double value, Labels labels = {}) { at(labels) = value; }

 private:
  void write_samples(std::string& out) const override;
  std::map<std::string, Value> values_;
};

class Counter : public Numbers {
 public:
  Counter(Families& all, const char* name, const char* help, std::vector<const char*> labels = {});
};

class Gauge : public Numbers {
 public:
  Gauge(Families& all, const char* name, const char* help, std::vector<const char*> labels = {});
};

class Histogram : public Family {
 public:
  /// bounds: upper ones of the buckets, rising; the last, +Inf, is added.
  Histogram(Families& all, const char* name, const char* help, std::vector<double> bounds, std::vector<const char*> labels = {});
  class Spread {
   public:
    explicit Spread(const std::vector<double>& bounds) : bounds_(bounds), counts_(bounds.size() + 1) {}
    void observe(double value);

   private:
    friend class Histogram;
    const std::vector<double>& bounds_;
    std::vector<std::atomic<double>> counts_;  ///< indexed as bounds, then +Inf; not cumulated
    std::atomic<double> sum_{0};
  };
  /// One of its spreads, as Numbers::at.
  Spread& at(Labels labels);
  void observe(double value, Labels labels = {}) { at(labels).observe(value); }

 private:
  void write_samples(std::string& out) const override;

  const std::vector<double> bounds_;
  std::map<std::string, Spread> spreads_;
};

}  // namespace cordillera::server::metrics
