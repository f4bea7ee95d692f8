#include "client_libs/bench/report.h"

#include <algorithm>

namespace hypermap::bench {

bool Consistency::holds() const {
  return lost() == 0 && edits_repeated == 0 && revisions_repeated == 0 &&
         revisions_reordered == 0 && watchers_behind == 0 && replicas_behind == 0 &&
         replicas_different == 0 && unanswered == 0 && problems.empty();
}

bool FleetReport::holds() const {
  return consistency.holds() &&
         std::all_of(outages.begin(), outages.end(),
                     [](const OutageReport& outage) { return outage.all_back_s.has_value(); });
}

}  // namespace hypermap::bench
