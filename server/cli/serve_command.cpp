#include <execinfo.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <sstream>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "server/api/documents/web.h"
#include "server/cli/commands.h"
#include "server/data/folder_lock.h"
#include "server/front/http_server.h"
#include "server/jobs/spare_disk.h"
#include "server/limits/descriptors.h"
#include "server/live/live_folder.h"
#include "server/live/live_notes.h"
#include "server/log/log.h"
#include "server/memory/heap.h"
#include "server/options/request_policy.h"
#include "server/sandbox/sandbox.h"

namespace cordillera::server {

namespace {

front::HttpLimits front_limits(const ServeSettings& settings) {
  const Limits& from = settings.limits;
  front::HttpLimits limits;
  limits.loops = from.loops;
  limits.connections = from.connections;
  limits.connections_per_client = from.client_connections;
  limits.uploads = from.uploads + from.client_uploads;  // those that the service refuses take a place for a moment too
  limits.uploads_per_client = 2 * from.client_uploads;
  limits.streams_per_client = from.client_streams;
  limits.unsent = std::uint64_t{from.unsent_mib} << 20;
  limits.unsent_per_client = std::uint64_t{from.client_unsent_mib} << 20;
  limits.answer = std::chrono::seconds(from.answer_seconds);
  limits.min_rate = from.min_rate;
  limits.head = std::chrono::seconds(from.head_seconds);
  limits.idle = std::chrono::seconds(from.idle_seconds);
  limits.trusted_proxies = settings.trusted_proxies;
  return limits;
}

/// What becomes of requests on the wire. The API tells of those that reach it.
front::OnServed note_of(metrics::ServiceMetrics& metrics) {
  return [&metrics, &sent = metrics.sent_bytes.at({})](const front::Served& served) {
    sent += static_cast<double>(served.bytes);
    if (!served.counted && !served.problem.empty())
      metrics.refused({served.route, served.method, served.status, 0, 0, served.problem});
    else if (served.by_front)
      metrics.problems.add(1, {served.problem});
    if (!logs_debug() || (!served.by_front && served.whole)) return;
    log_debug(served.whole ? "refused before it was a request" : "the client went before the end of the answer",
              {{"client", served.client},
               {"path", served.path.substr(0, 300)},
               {"status", std::int64_t{served.status}},
               {"sent", static_cast<std::int64_t>(served.bytes)},
               {"seconds", served.seconds},
               {"problem", served.problem}});
  };
}

/// Looks at the heap now and then: what a burst took is given back when it is over, and the reserve is laid aside again.
void look_after_heap(boost::asio::steady_timer& timer) {
  timer.expires_after(std::chrono::seconds(10));
  timer.async_wait([&timer](const boost::system::error_code& error) {
    if (error) return;
    trim_heap();
    keep_reserve();
    look_after_heap(timer);
  });
}

/// Of folders with colons between.
std::vector<std::string> missing_folders(const std::string& list) {
  std::vector<std::string> missing;
  std::error_code error;
  std::istringstream folders(list);
  for (std::string one; std::getline(folders, one, ':');) {
    if (!one.empty() && !std::filesystem::is_directory(one, error)) missing.push_back(one);
  }
  return missing;
}

/// Of this process, before anything is opened. A problem is the settings'.
std::optional<proto::Problem> set_up(Settings& settings, const std::string& program) {
  set_up_heap();
  signal(SIGXFSZ, SIG_IGN);  // a file beyond the limit of its size is a write that fails, as on a full disk
  const bool named_web = !settings.serve.web.empty();
  if (!named_web) settings.serve.web = default_web_folder(program);
  start_log(settings.serve.log_level, settings.serve.log_format);
  std::error_code error;
  if (named_web && !std::filesystem::exists(std::filesystem::path(settings.serve.web) / "index.html", error))
    log_warning("there is no viewer in " + settings.serve.web + ", which --web names: / shows a plain page");
  for (const std::string& folder : missing_folders(settings.serve.geoids))
    log_warning("there is no folder " + folder + ", which --geoids names: no geoid grid is found there");
  // Where raster looks for geoid grids, in the processes that build.
  if (!settings.serve.geoids.empty()) setenv("CORDILLERA_GEOIDS", settings.serve.geoids.c_str(), 1);
  // What is a default of every request must be something that a request may ask for.
  if (auto refused = apply_policy(settings, settings.build)) return refused;
  if (!settings.serve.live.empty()) {
    if (auto refused = refuse_live_folder(settings.serve.live, settings.serve.data)) return refused;
  }
  // glibc loads what it ends threads with when it first needs it, and ends the process where there is no memory for that by then.
  std::array<void*, 1> frame{};
  backtrace(frame.data(), static_cast<int>(frame.size()));
  const std::string fewer = limits::fit_to_descriptors(settings.serve, limits::raise_descriptor_limit());
  if (!fewer.empty()) log_warning(fewer);
  return std::nullopt;
}

/// Whoever sends it to a service wants files to be read again.
void pass_over_hangups(boost::asio::signal_set& hangups) {
  hangups.async_wait([&hangups](const boost::system::error_code& error, int) {
    if (error) return;
    log_info("SIGHUP changes nothing: a changed file of tokens is read by itself, other settings at a start");
    pass_over_hangups(hangups);
  });
}

/// Not where nohup has taken it away.
bool gets_hangups() {
  struct sigaction now {};
  return sigaction(SIGHUP, nullptr, &now) == 0 && now.sa_handler != SIG_IGN;
}

/// Serves until it is told to stop.
void run_until_stopped(const ServeSettings& settings, Service& service, front::HttpServer& http, LiveNotes live_notes,
                       const std::function<void(int port)>& listening) {
  boost::asio::io_context io;
  boost::asio::signal_set signals(io, SIGINT, SIGTERM), hangups(io);
  // A window that is closed ends what was begun in it, or for somebody to look at.
  if (listening || (gets_hangups() && isatty(STDERR_FILENO) == 1)) {
    signals.add(SIGHUP);
  } else if (gets_hangups()) {
    hangups.add(SIGHUP);
    pass_over_hangups(hangups);
  }
  signals.async_wait([&](const boost::system::error_code& error, int) {
    if (error) return;
    log_info("stopping: running builds go on at the next start");
    service.stop();
    http.stop();
  });
  boost::asio::steady_timer heap(io);
  look_after_heap(heap);
  std::thread waiter([&] { io.run(); });

  log_info("jobs are confined by " + sandbox::offered_words());
  const std::string host = settings.listen.substr(0, settings.listen.rfind(':'));
  log_info("listening on http://" + host + ":" + std::to_string(http.port()) + "/, data in " +
           std::filesystem::absolute(settings.data).string());
  if (listening) listening(http.port());
  std::optional<LiveFolder> live;
  if (!settings.live.empty()) live.emplace(service, settings.live, std::move(live_notes));
  http.run();
  live.reset();
  io.stop();
  waiter.join();
  log_info("stopped");
}

int serve_with(Settings settings, const std::string& program, const std::function<void(int port)>& listening) {
  if (const auto refused = set_up(settings, program)) return wrong_usage(*refused);
  // Not the path: an upgrade may have put another program there since.
  const std::uint32_t free_percent = settings.serve.limits.free_percent;
  auto service = Service::open(settings, sparing(child_runner("/proc/self/exe", free_percent), free_percent));
  if (!service) return fail(service.problem());
  LiveNotes live;
  if (!settings.serve.live.empty()) {
    auto notes = read_live_notes((*service)->layout().live(), settings.serve.live);
    if (!notes) return fail(notes.problem());
    live = std::move(*notes);
  }
  Api api(**service);
  auto http = front::HttpServer::bind(api, settings.serve.listen, front_limits(settings.serve), note_of((*service)->metrics()));
  if (!http) return fail(http.problem());

  if (!has_memory(kToListen_bytes))
    return fail({"memory-limit", "less than " + std::to_string(kToListen_bytes >> 20) + " MiB of memory are left to answer with",
                 "a higher limit of memory (ulimit -v)", ""});

  (*service)->watch_front([&http] { return FrontCounts{(*http)->connections(), (*http)->unsent_bytes()}; });

  run_until_stopped(settings.serve, **service, **http, std::move(live), listening);
  return kDone;
}

/// Boost's threads have an exception of their own for it.
bool lacks_a_thread(const std::exception& error) {
  const auto* const of_boost = dynamic_cast<const boost::system::system_error*>(&error);
  const auto* const of_system = dynamic_cast<const std::system_error*>(&error);
  return (of_boost != nullptr && of_boost->code() == boost::asio::error::try_again) ||
         (of_system != nullptr && of_system->code() == std::errc::resource_unavailable_try_again);
}

}  // namespace

int serve_command(const Settings& given, const std::string& program, const std::function<void(int port)>& listening) {
  try {
    return serve_with(given, program, listening);
  } catch (const std::exception& error) {
    if (!lacks_a_thread(error)) throw;
    return fail({"memory-limit", "no thread can be begun: there is no memory for it, or no process more is allowed",
                 "a higher limit of memory (ulimit -v) or of processes (ulimit -u, TasksMax= of a systemd unit)", ""});
  }
}

}  // namespace cordillera::server
