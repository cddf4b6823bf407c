// What the kernel tells about this process.
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "proto/files.h"
#include "server/metrics/service_metrics.h"

namespace cordillera::server::metrics {
namespace {

struct Stat {
  double cpu_seconds = 0, start_ticks = 0, threads = 0, resident_bytes = 0, virtual_bytes = 0;
};

/// Fields of proc(5), counted from the one after the name, which may hold anything.
Stat read_stat() {
  const std::string text = proto::bytes_of_file("/proc/self/stat").value_or("");
  std::istringstream fields(text.substr(text.rfind(')') + 1));
  std::vector<std::string> words;
  for (std::string word; fields >> word;) words.push_back(word);
  if (words.size() < 22) return {};
  const auto at = [&](std::size_t field) { return std::stod(words[field - 3]); };
  const double ticks = static_cast<double>(sysconf(_SC_CLK_TCK)), page = static_cast<double>(sysconf(_SC_PAGESIZE));
  return {(at(14) + at(15)) / ticks, at(22) / ticks, at(20), at(24) * page, at(23)};
}

double boot_time() {
  std::ifstream file("/proc/stat");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("btime ", 0) == 0) return std::stod(line.substr(6));
  }
  return 0;
}

double open_descriptors() {
  std::error_code error;
  double count = -1;  // the one that reads the folder
  for (std::filesystem::directory_iterator at("/proc/self/fd", error), end; !error && at != end; at.increment(error)) ++count;
  return count;
}

}  // namespace

void write_process(std::string& out) {
  const Stat stat = read_stat();
  rlimit descriptors{};
  getrlimit(RLIMIT_NOFILE, &descriptors);
  const auto counter = [&](const char* name, const char* help, double value) {
    Families one;
    Counter family(one, name, help);
    family.set(value);
    one.write(out);
  };
  const auto gauge = [&](const char* name, const char* help, double value) {
    Families one;
    Gauge family(one, name, help);
    family.set(value);
    one.write(out);
  };
  counter("process_cpu_seconds_total", "CPU time of the service itself; builds are processes of their own.", stat.cpu_seconds);
  gauge("process_resident_memory_bytes", "Memory in use.", stat.resident_bytes);
  gauge("process_virtual_memory_bytes", "Addresses in use.", stat.virtual_bytes);
  gauge("process_open_fds", "Descriptors that are open.", open_descriptors());
  gauge("process_max_fds", "Descriptors that may be.", static_cast<double>(descriptors.rlim_cur));
  gauge("process_threads", "Threads.", stat.threads);
  gauge("process_start_time_seconds", "When it was started, Unix time.", boot_time() + stat.start_ticks);
}

}  // namespace cordillera::server::metrics
