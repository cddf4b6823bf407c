#pragma once
// What a client may take of the server: time, connections, bytes. Every one an option of `serve` or a constant with its reason.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "proto/cores.h"

namespace cordillera::server::front {

struct HttpLimits {
  std::uint32_t loops = std::clamp(proto::usable_cores(), 1u, 16u);  ///< threads that read and write connections
  std::uint32_t connections = 4096;                                  ///< at a time; beyond them the longest idle one makes room
  std::uint32_t connections_per_client = 512;                        ///< of one address: an office behind one, with six a browser
  std::uint32_t uploads = 64;                                        ///< requests with a body at a time; each has a thread
  std::uint32_t uploads_per_client = 16;
  std::uint32_t streams_per_client = 64;  ///< event streams and Prefer: wait
  std::uint64_t unsent =
      std::uint64_t{512} << 20;  ///< bytes of answers that clients have yet to read; what several share counts once
  std::uint64_t unsent_per_client = std::uint64_t{128} << 20;
  std::uint32_t min_rate = 1024;             ///< bytes a second that a body or a reader must reach on average
  std::chrono::seconds head{10};             ///< from a request's first byte to the end of its head
  std::chrono::seconds idle{60};             ///< a connection without a request
  std::chrono::seconds stall{30};            ///< without a single byte, in the middle of a body or an answer
  std::chrono::seconds grace{10};            ///< before min_rate counts
  std::chrono::seconds answer{600};          ///< that a reader may keep the server waiting in all, however large the answer
  std::chrono::seconds drain{10};            ///< for answers under way when the server stops
  std::vector<std::string> trusted_proxies;  ///< addresses whose X-Forwarded-For is believed

  std::size_t target_bytes = 8192;
  std::size_t head_bytes = 32768;
  std::size_t fields = 100;
};

}  // namespace cordillera::server::front
