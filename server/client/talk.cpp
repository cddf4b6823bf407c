#include "server/client/talk.h"

#include <algorithm>
#include <iostream>
#include <thread>
#include <utility>

#include "proto/numbers.h"
#include "proto/utf8.h"
#include "server/http/problems.h"
#include "server/options/spoken_words.h"

namespace cordillera::server::client {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFirstPause{250}, kLongestPause{10000};
const std::string kUrn = "urn:cordillera:problem:";

bool passes_by(const Answer& answer) {
  if (!answer.trouble.empty()) return true;
  switch (answer.status) {
    case 408:
    case 429:
    case 502:
    case 503:
    case 504: return true;
    // Of our own earlier request, whose connection broke and whose end the service has not noticed yet.
    case 409:
      return answer.body.find(kUrn + "upload-conflict") != std::string::npos ||
             answer.body.find(kUrn + "idempotency-key-in-use") != std::string::npos;
    default: return false;
  }
}

milliseconds asked_for(const Answer& answer) {
  constexpr unsigned kMost_s = 9999;
  const auto seconds = proto::number<unsigned>(answer.header("retry-after"));
  return std::chrono::seconds(seconds && *seconds <= kMost_s ? *seconds : 0);
}

}  // namespace

void Talk::moved() {
  moved_ = std::chrono::steady_clock::now();
  pause_ = kFirstPause;
}

Answer Talk::once(const Call& call) {
  Answer answer = connection_.send(call);
  heard_ = heard_ || answer.reached;
  return answer;
}

bool Talk::may_help(const Answer& answer) {
  // A service that was never there is an address that is wrong, and said at once.
  if (!heard_ || !passes_by(answer)) return false;
  const proto::Problem problem = problem_of(answer);
  if (problem.type == "tile-not-ready" && std::exchange(not_ready_, problem.detail) != problem.detail)
    moved_ = std::chrono::steady_clock::now();  // it says how much is made
  const milliseconds wait = std::max(pause_, asked_for(answer));
  if (std::chrono::steady_clock::now() + wait > moved_ + kPatience) return false;
  if (words_ == Verbosity::all) {
    std::cerr << "cordillera: " << problem.detail << "; trying again in " << (wait.count() + 999) / 1000 << " s\n";
  }
  std::this_thread::sleep_for(wait);
  pause_ = std::min(2 * pause_, kLongestPause);
  return true;
}

Answer Talk::patiently(const Call& call) {
  while (true) {
    Answer answer = once(call);
    if (!may_help(answer)) return answer;
  }
}

proto::Problem Talk::problem_of(const Answer& answer) const {
  const std::string accepted = "an address where cordillera serve listens, with --server or CORDILLERA_SERVER";
  if (!answer.reached)
    return {"service-unreachable", "no service answers at " + address_ + ": " + answer.trouble, accepted, "--server"};
  if (!answer.trouble.empty()) return {"connection-broken", address_ + ": " + answer.trouble, "the same line again", ""};
  const Json json = Json::parse(answer.body, nullptr, false);
  if (json.is_object() && json.contains("type")) return problem_in(json);
  if (answer.status == 502 || answer.status == 503 || answer.status == 504)
    return {"service-unreachable",
            "the proxy at " + address_ + " does not reach its service (" + std::to_string(answer.status) + ")",
            "trying again later", ""};
  if (answer.status / 100 == 3)
    return {"answer-unknown", address_ + " leads to " + proto::one_line(answer.header("location")), "that address, as --server",
            "--server"};
  return {"answer-unknown", address_ + " answers " + std::to_string(answer.status) + ", and not as Cordillera does", accepted,
          "--server"};
}

std::string text_in(const Json& json, const char* name) {
  const auto found = json.find(name);
  return found != json.end() && found->is_string() ? proto::one_line(found->get<std::string>()) : std::string();
}

proto::Problem problem_in(const Json& json) {
  const auto text = [&json](const char* name) { return text_in(json, name); };
  std::string slug = text("type");
  if (slug.starts_with(kUrn)) slug.erase(0, kUrn.size());
  return {slug, text("detail").empty() ? text("title") : text("detail"), text("accepted"), text("parameter")};
}

int exit_code(const proto::Problem& problem) {
  if (problem.type == "usage" || (problem.type.starts_with("option") && problem.parameter.starts_with("--"))) return kUsage;
  const int status = problem_kind(problem.type).status;
  const bool later = status == 408 || status == 429 || status == 503 || status == 507;
  const bool broken =
      problem.type == "service-unreachable" || problem.type == "connection-broken" || problem.type == "upload-running";
  return later || broken ? kTryAgain : kFailed;
}

Json told_json(const proto::Problem& problem) {
  Json json = problem_json(problem);
  if (is_of_commands(problem.type)) json.erase("status");
  return json;
}

int tell(const proto::Problem& problem, Show show) {
  if (show == Show::json) {
    std::cout << told_json(problem).dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
  } else {
    std::cerr << "cordillera: " << problem_kind(problem.type).title << "\n  " << as_typed(problem.detail) << "\n";
    if (!problem.accepted.empty()) std::cerr << "  accepted: " << as_typed(problem.accepted) << "\n";
  }
  return exit_code(problem);
}

Json object_in(const Answer& answer) {
  Json json = Json::parse(answer.body, nullptr, false);
  return json.is_object() ? json : Json::object();
}

}  // namespace cordillera::server::client
