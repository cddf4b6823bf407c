#pragma once
// Everything that the service counts, one member a family, in the order of /metrics. A dashboard that names them:
// deploy/grafana.json.
#include <cstdint>
#include <string>

#include "server/metrics/family.h"

namespace cordillera::server::metrics {

/// A request that was answered.
struct Finished {
  std::string route;
  std::string method;
  int status = 0;
  double seconds = 0;
  std::uint64_t received = 0;  ///< bytes of the body
  std::string problem;         ///< slug, or empty
};

/// What is counted of the answers of a route that are given without being made, each looked up once.
struct KeptCounts {
  Counter::Value& whole;      ///< 200
  Counter::Value& unchanged;  ///< 304
  Histogram::Spread& seconds;
};

/// Thread-safe.
class ServiceMetrics {
  Families all_;  // before its families

 public:
  ServiceMetrics();
  /// Those of GET.
  KeptCounts kept_counts(const std::string& route);
  void finished(const Finished& request);
  /// One that was refused before it could be made. Its seconds are not looked at: they are the client's.
  void refused(const Finished& request);
  /// Every family, and numbers of this process.
  std::string text() const;

  Gauge build_info{all_, "cordillera_build_info", "1, with the version of the program.", {"version"}};
  // HTTP.
  Counter requests{all_, "cordillera_http_requests_total", "Requests answered.", {"route", "method", "status"}};
  Histogram request_seconds{all_,
                            "cordillera_http_request_duration_seconds",
                            "Seconds until the answer was made; of a stream until its beginning.",
                            {0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 10, 60},
                            {"route"}};
  Gauge in_flight{all_, "cordillera_http_requests_in_flight", "Requests being answered now."};
  Gauge connections{all_, "cordillera_http_connections", "Connections that are open."};
  Gauge unsent_bytes{all_, "cordillera_http_unsent_bytes",
                     "Bytes of large answers that clients have yet to read; what several share counts once."};
  Gauge waiting{all_, "cordillera_http_waiting_clients", "Clients that wait for progress: streams of events and Prefer: wait."};
  Counter received_bytes{all_, "cordillera_http_received_bytes_total", "Bytes of bodies received."};
  Counter sent_bytes{all_, "cordillera_http_sent_bytes_total", "Bytes of answers that were sent, heads included."};
  Counter problems{all_, "cordillera_problems_total", "Problems told to clients, by their type.", {"type"}};
  Counter denied{all_, "cordillera_access_denied_total", "Requests refused for want of a token or of its role.", {"reason"}};

  // Uploads and builds.
  Gauge uploads{all_, "cordillera_uploads_in_progress", "Rasters that are being received."};
  Gauge datasets{all_, "cordillera_datasets", "Datasets by state; queued ones are the queue.", {"state"}};
  Gauge queue_limit{all_, "cordillera_queue_limit", "Builds that may wait."};
  Gauge changes_waiting{all_, "cordillera_changes_waiting",
                        "Changes of datasets' rasters that are accepted and have no version yet."};
  Counter builds{all_, "cordillera_builds_total", "Builds that ended.", {"outcome"}};
  Histogram build_seconds{all_,
                          "cordillera_build_duration_seconds",
                          "Seconds that builds took, from their start to their end.",
                          {1, 5, 15, 60, 300, 900, 3600, 14400, 86400},
                          {"outcome"}};
  Histogram first_tile_seconds{all_,
                               "cordillera_first_tile_seconds",
                               "Seconds from the last byte of a post to the first tiles that can be read.",
                               {0.25, 0.5, 1, 2, 5, 10, 30, 60, 300, 3600},
                               {"kind"}};
  Histogram tile_wait_seconds{all_,
                              "cordillera_tile_wait_seconds",
                              "Seconds that requests waited for tiles which were still to be made, by how that ended.",
                              {0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10, 30, 60, 600},
                              {"outcome"}};
  Gauge tile_waiting{all_, "cordillera_tile_waiting_requests", "Requests that wait for tiles which are still to be made."};
  Gauge live_bytes{all_, "cordillera_live_bytes", "Bytes on disk of what was fetched or made because somebody read it."};
  Counter live_forgotten{all_, "cordillera_live_forgotten_total", "Datasets of which that went to make room.", {"kind"}};
  Counter live_asked{
      all_, "cordillera_live_asked_total", "Addresses asked whether they have what was fetched from them.", {"outcome"}};
  Counter stage_seconds{all_, "cordillera_build_stage_seconds_total", "Seconds spent in the stages of builds.", {"stage"}};
  Counter blocks{all_, "cordillera_build_blocks_total", "Blocks built and committed."};
  Counter samples{all_, "cordillera_build_samples_total", "Samples of the finest lattice that builds went through."};
  Counter versions{all_, "cordillera_versions_total", "Changes of datasets' rasters that came to an end.", {"outcome"}};
  Counter device_lost{all_, "cordillera_build_device_lost_total", "Builds begun anew on the CPU because the GPU was lost."};

  // Reading.
  Counter store_opens{all_, "cordillera_store_opens_total", "Datasets looked for among the open ones.", {"result"}};
  Counter store_damaged{all_, "cordillera_store_damaged_total",
                        "Answers refused because what is stored is not what was written."};
  Gauge datasets_damaged{all_, "cordillera_datasets_damaged",
                         "Datasets of which something damaged was read since they were published or the service started."};

  // The machine.
  Gauge ready{all_, "cordillera_ready", "1 when the service takes work, else 0."};
  Gauge disk_size{all_, "cordillera_disk_size_bytes", "Size of the disk that holds the data."};
  Gauge disk_free{all_, "cordillera_disk_free_bytes", "Bytes free on it."};
  Gauge gpu_memory{all_, "cordillera_gpu_memory_bytes", "Memory of the GPUs.", {"gpu", "kind"}};
};

/// process_… as other programs have them: CPU, memory, descriptors, threads, start.
void write_process(std::string& out);

}  // namespace cordillera::server::metrics
