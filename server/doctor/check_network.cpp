// Where the service would listen, and for whom.
#include <sys/resource.h>
#include <unistd.h>

#include "server/access/gate.h"
#include "server/data/layout.h"
#include "server/datasets/registry.h"
#include "server/doctor/doctor.h"
#include "server/doctor/port.h"

namespace cordillera::server::doctor {
namespace {

Finding port(const std::string& listen) {
  const std::string why = cannot_listen(listen);
  if (why.empty()) return Finding{"port", Health::good, listen + " is free", ""};
  return Finding{"port", Health::bad, listen + ": " + why,
                 "--listen with an address of this machine and a free port; is the service running already?"};
}

using OpenGate = proto::Result<std::unique_ptr<access::Gate>>;

Finding access_of(const ServeSettings& serve, const OpenGate& gate) {
  if (!gate) return Finding{"access", Health::bad, gate.problem().detail, gate.problem().accepted};
  if ((*gate)->has_tokens()) return Finding{"access", Health::good, "writing takes a token", ""};
  if (serve.insecure_writes)
    return Finding{"access", Health::warning, "everybody who reaches the port may post and delete",
                   "--tokens FILE in place of --insecure-writes"};
  return Finding{"access", Health::good, "whoever is on this machine may write, nobody else", ""};
}

/// Private datasets of a service without tokens; nothing: there are none, or another finding says what is wrong with the folder.
std::optional<Finding> private_ones(const ServeSettings& serve, const OpenGate& gate) try {
  std::error_code error;
  const auto file = Layout{serve.data}.registry();
  if (!gate || (*gate)->has_tokens() || !std::filesystem::exists(file, error)) return std::nullopt;
  const std::size_t hidden = count_private(*Registry::read_only(file.string()));
  if (hidden == 0) return std::nullopt;
  return Finding{"private", Health::warning,
                 "without tokens only this machine reads what is private (" + std::to_string(hidden) +
                     (hidden == 1 ? " dataset)" : " datasets)"),
                 "--tokens FILE, if others are to read it"};
} catch (const RegistryError&) { return std::nullopt; }

Finding descriptors() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  const std::string what = std::to_string(limit.rlim_cur) + " descriptors";
  if (limit.rlim_cur >= 4096) return Finding{"descriptors", Health::good, what, ""};
  return Finding{"descriptors", Health::warning, what + ": each connection takes one, and each dataset that is read some",
                 "ulimit -n 65536, or LimitNOFILE= of a systemd unit"};
}

}  // namespace

void check_network(const Settings& settings, Findings& findings) {
  const ServeSettings& serve = settings.serve;
  const OpenGate gate = access::Gate::open({serve.listen, serve.tokens, serve.token_lines, serve.insecure_writes});
  findings.push_back(port(serve.listen));
  findings.push_back(access_of(serve, gate));
  if (auto found = private_ones(serve, gate)) findings.push_back(*found);
  findings.push_back(descriptors());
}

}  // namespace cordillera::server::doctor
