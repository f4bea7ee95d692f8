// The numbers of the process itself.
#ifndef HYPERMAP_SERVER_METRICS_PROCESS_METRICS_H_
#define HYPERMAP_SERVER_METRICS_PROCESS_METRICS_H_

#include <prometheus/metric_family.h>

#include <vector>

namespace hypermap::server {

// Adds the standard metrics of a process, by the names of Prometheus's own client libraries:
// process_cpu_seconds_total, process_resident_memory_bytes, process_open_fds, process_max_fds,
// process_threads and process_start_time_seconds.
void AddProcess(std::vector<prometheus::MetricFamily>& out);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_METRICS_PROCESS_METRICS_H_
