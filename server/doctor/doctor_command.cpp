#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "server/cli/commands.h"
#include "server/doctor/doctor.h"
#include "server/http/json.h"
#include "server/log/log.h"

namespace cordillera::server::doctor {
namespace {

Json to_json(const Findings& findings, bool fit) {
  Json json;
  json["version"] = CORDILLERA_VERSION;
  json["fit"] = fit;
  json["checks"] = Json::array();
  for (const Finding& finding : findings) {
    Json one = {{"name", finding.name}, {"health", to_string(finding.health)}, {"what", finding.what}};
    if (!finding.advice.empty()) one["advice"] = finding.advice;
    json["checks"].push_back(one);
  }
  return json;
}

void print(const Findings& findings) {
  std::size_t width = 0;
  for (const Finding& finding : findings) width = std::max(width, finding.name.size());
  for (const Finding& finding : findings) {
    std::string line = to_string(finding.health);
    line.resize(9, ' ');
    line += finding.name;
    line.resize(11 + width, ' ');
    std::cout << line << printable(finding.what) << '\n';
    if (!finding.advice.empty()) std::cout << std::string(11 + width, ' ') << "-> " << finding.advice << '\n';
  }
}

}  // namespace

const char* to_string(Health health) {
  constexpr const char* kNames[] = {"good", "warning", "bad"};
  return kNames[static_cast<int>(health)];
}

int doctor_command(const Settings& settings, Output output) {
  start_log("error");
  if (!settings.serve.geoids.empty()) setenv("CORDILLERA_GEOIDS", settings.serve.geoids.c_str(), 1);
  Findings findings;
  for (const auto check : {check_folders, check_network, check_libraries, check_gpu, check_build}) check(settings, findings);
  const bool fit =
      std::none_of(findings.begin(), findings.end(), [](const Finding& finding) { return finding.health == Health::bad; });
  if (output == Output::json) {
    std::cout << dump(to_json(findings, fit));
  } else {
    print(findings);
    std::cout << (fit ? "fit to serve" : "not fit to serve") << '\n';
  }
  std::cout << std::flush;
  return fit ? kDone : kFailed;
}

}  // namespace cordillera::server::doctor
