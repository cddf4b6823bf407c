#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "server/commands.h"
#include "server/http.h"
#include "server/log.h"
#include "server/request_policy.h"
#include "server/web.h"

namespace cordillera::server {

int serve_command(const Settings& given, const std::string& program) {
  Settings settings = given;
  if (settings.serve.web.empty()) settings.serve.web = default_web_folder(program);
  start_log(settings.serve.log_level);
  // Where raster looks for geoid grids, in the processes that build.
  if (!settings.serve.geoids.empty()) setenv("CORDILLERA_GEOIDS", settings.serve.geoids.c_str(), 1);
  // What is a default of every request must be something that a request may ask for.
  if (auto refused = apply_policy(settings, settings.build)) {
    complain(*refused);
    return kUsage;
  }

  // Not the path: an upgrade may have put another program there since.
  auto service = Service::open(settings, child_runner("/proc/self/exe"));
  if (!service) {
    complain(service.problem());
    return kFailed;
  }
  Api api(**service);
  auto http = HttpServer::bind(api, settings.serve.listen);
  if (!http) {
    complain(http.problem());
    return kFailed;
  }

  boost::asio::io_context io;
  boost::asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&](const boost::system::error_code& error, int) {
    if (error) return;
    log_info("stopping: running builds go on at the next start");
    (*service)->stop();
    (*http)->stop();
  });
  std::thread waiter([&] { io.run(); });

  const std::string host = settings.serve.listen.substr(0, settings.serve.listen.rfind(':'));
  log_info("listening on http://" + host + ":" + std::to_string((*http)->port()) + "/, data in " +
           std::filesystem::absolute(settings.serve.data).string());
  (*http)->run();
  io.stop();
  waiter.join();
  log_info("stopped");
  return kDone;
}

}  // namespace cordillera::server
