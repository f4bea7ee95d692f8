// The result of a load.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_REPORT_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_REPORT_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client_libs/bench/fleet_options.h"
#include "client_libs/bench/recorder.h"
#include "client_libs/bench/server_numbers.h"
#include "map/snapshot.h"

namespace hypermap::bench {

// Tells whether everything that the server acknowledged is there at the end, and all followers have
// it.
struct Consistency {
  Revision first = 0;   // the revision at the start
  Revision newest = 0;  // the revision at the end
  int64_t revisions_with_changes = 0;

  int64_t edits_acknowledged = 0;
  int64_t edits_lost = 0;
  int64_t edits_repeated = 0;  // carried out twice
  int64_t observations_acknowledged = 0;
  int64_t observations_lost = 0;
  // Sums over all watchers and the replicas that only receive.
  int64_t revisions_missed = 0;
  int64_t revisions_repeated = 0;
  int64_t revisions_reordered = 0;
  int watchers_behind = 0;     // of the same, those that did not reach the newest revision
  int replicas_behind = 0;     // the same, of full replicas
  int replicas_different = 0;  // full ones that have other numbers of objects than the server
  int64_t unanswered = 0;      // operations
  // Why something could not be checked.
  std::vector<std::string> problems;

  // Acknowledged edits and observations that the server does not have, and revisions that did not
  // reach a watcher.
  int64_t lost() const { return edits_lost + observations_lost + revisions_missed; }
  bool holds() const;
};

// An outage with times in seconds from the start of the load.
struct OutageReport {
  double last_answer_before_s = 0.0;
  double first_failure_s = 0.0;
  std::optional<double> first_answer_after_s;
  // From the last answer before to the first one to a client that had failed.
  std::optional<double> down_s;
  // From the first answer after until all clients are back; nullopt: not all are.
  std::optional<double> all_back_s;
  int clients_failed = 0;
  int clients_not_back = 0;
};

struct FleetReport {
  FleetOptions options;
  std::map<OperationKind, OperationTotals> operations;
  Consistency consistency;
  std::vector<OutageReport> outages;
  // Resources of the process that makes the load: CPU time of the measured part, the largest
  // memory, and the threads at the beginning of the measured part.
  double generator_cpu_s = 0.0;
  int64_t generator_max_resident_bytes = 0;
  int generator_threads = 0;
  std::optional<ServerNumbers> server;

  bool holds() const;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_REPORT_H_
