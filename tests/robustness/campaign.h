// All trials of all scenarios, on several processes, and the table of what came of them.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_CAMPAIGN_H_
#define HYPERMAP_TESTS_ROBUSTNESS_CAMPAIGN_H_

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "tests/robustness/trials.h"

namespace hypermap::robustness {

struct CampaignOptions {
  uint64_t seed = 1;
  bool is_short = false;
  bool every_call = false;             // not only some of the calls that are alike
  std::vector<std::string> scenarios;  // their names; none: all
  std::vector<std::string> faults;
  int64_t trial = -1;  // only the batch that has this one; negative: all
  int jobs = 1;        // processes
  Plant plant = Plant::kNone;
  std::string folder;  // for the files of the runs; removed afterwards
};

struct CampaignReport {
  std::map<std::pair<std::string, Fault>, Counts> rows;
  std::vector<std::string> scenarios;  // in their order
  std::vector<std::string> problems;
  int64_t num_calls = 0;  // of the scenarios, which can fail

  Counts Sum() const;
  Counts SumOf(Fault fault) const;
};

// Errors if a scenario fails without any fault. REQUIRES: this process has one thread.
absl::StatusOr<CampaignReport> RunCampaign(const CampaignOptions& options);

// A row for each scenario and fault, and one for each fault in all.
std::string TableOf(const CampaignReport& report);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_CAMPAIGN_H_
