#include "server/doctor/port.h"

#include <netdb.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>

#include "raster/disk/descriptor.h"
#include "server/access/client_address.h"

namespace cordillera::server::doctor {

std::string cannot_listen(const std::string& listen) {
  const std::string host = access::host_of(listen), port = listen.substr(listen.rfind(':') + 1);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* list = nullptr;
  if (const int failed = getaddrinfo(host.c_str(), port.c_str(), &hints, &list); failed != 0) return gai_strerror(failed);
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owned(list, freeaddrinfo);
  const raster::Descriptor socket(::socket(list->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const int yes = 1;
  setsockopt(socket.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const bool listens = ::bind(socket.number(), list->ai_addr, list->ai_addrlen) == 0 && ::listen(socket.number(), 1) == 0;
  return listens ? "" : strerror(errno);
}

}  // namespace cordillera::server::doctor
