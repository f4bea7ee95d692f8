#include "tests/robustness/campaign.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"

namespace hypermap::robustness {
namespace {

// Trials that one process makes without a break. Power losses share the disk of a batch, so that a
// trial is repeated together with its batch.
constexpr int64_t kBatch = 25;

struct Task {
  const Rehearsal* rehearsal = nullptr;
  Trials trials;
};

// How many trials of a fault each scenario gets; 0: one for each call and error.
int64_t NumTrials(Fault fault, bool is_short) {
  switch (fault) {
    case Fault::kCallFails:
      return is_short ? 15 : 0;
    case Fault::kCallsFail:
      return is_short ? 4 : 60;
    case Fault::kShortWrite:
    case Fault::kDiskFull:
    case Fault::kDiskReadOnly:
    case Fault::kNoDescriptors:
      return is_short ? 2 : 25;
    case Fault::kKill:
      return is_short ? 5 : 80;
    case Fault::kPowerLoss:
      return is_short ? 25 : 800;
    case Fault::kPowerLossAfterFailedSync:
      return is_short ? 3 : 0;
    case Fault::kPowerLossInRecovery:
      return is_short ? 3 : 100;
    case Fault::kBitFlip:
      return is_short ? 4 : 50;
    case Fault::kBitFlipAfterKill:
      return is_short ? 2 : 25;
  }
  return 0;
}

bool IsWanted(const std::vector<std::string>& names, const std::string& name) {
  return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
}

std::vector<Task> TasksOf(const Rehearsal& rehearsal, const CampaignOptions& options) {
  std::vector<Task> tasks;
  for (int i = 0; i < kNumFaults; ++i) {
    const auto fault = static_cast<Fault>(i);
    if (!IsWanted(options.faults, NameOf(fault))) continue;
    const int64_t different = NumDifferent(rehearsal, fault, options.every_call);
    int64_t count = NumTrials(fault, options.is_short);
    if (different > 0) count = count == 0 ? different : std::min(count, different);
    for (int64_t first = 0; first < count; first += kBatch) {
      const int64_t size = std::min(kBatch, count - first);
      const bool has_trial = options.trial >= first && options.trial < first + size;
      if (options.trial >= 0 && !has_trial) continue;
      tasks.push_back({&rehearsal, {fault, first, size, options.every_call}});
    }
  }
  return tasks;
}

nlohmann::json ToJson(size_t task, const TrialReport& report) {
  const Counts& counts = report.counts;
  nlohmann::json problems = nlohmann::json::array();
  for (const std::string& problem : report.problems) problems.push_back(problem);
  return {task,          counts.runs,      counts.lost,       counts.half_done, counts.wrong,
          counts.wedged, counts.by_itself, counts.by_restart, counts.named,     problems};
}

TrialReport FromJson(const nlohmann::json& json) {
  TrialReport report;
  Counts& counts = report.counts;
  int i = 0;
  for (int64_t* count : {&counts.runs, &counts.lost, &counts.half_done, &counts.wrong,
                         &counts.wedged, &counts.by_itself, &counts.by_restart, &counts.named}) {
    *count = json[++i].get<int64_t>();
  }
  report.problems = json[++i].get<std::vector<std::string>>();
  return report;
}

// A process that carries out every n-th task, and writes a line for each.
struct Worker {
  pid_t pid = 0;
  int fd = -1;
  std::string unread;
};

Worker StartWorker(const std::vector<Task>& tasks, const CampaignOptions& options, int number) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return {};
  Worker worker;
  worker.pid = fork();
  worker.fd = ends[0];
  if (worker.pid != 0) {
    close(ends[1]);
    return worker;
  }
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const std::string folder = absl::StrCat(options.folder, "/", number);
  for (size_t i = number; i < tasks.size(); i += options.jobs) {
    const TrialReport report =
        RunTrials(*tasks[i].rehearsal, tasks[i].trials, options.seed, options.plant, folder);
    const auto replace = nlohmann::json::error_handler_t::replace;
    std::string line = ToJson(i, report).dump(-1, ' ', false, replace) + "\n";
    for (absl::string_view rest = line; !rest.empty();) {
      const ssize_t size = write(ends[1], rest.data(), rest.size());
      if (size < 0 && errno != EINTR) _exit(1);
      rest.remove_prefix(static_cast<size_t>(std::max<ssize_t>(size, 0)));
    }
  }
  _exit(0);
}

// Tells every minute how far the tasks are.
class CampaignProgress {
 public:
  explicit CampaignProgress(size_t num_tasks) : num_tasks_(num_tasks) {}

  void AddDone() {
    ++num_done_;
    if (absl::Now() < next_) return;
    next_ += absl::Minutes(1);
    std::cerr << num_done_ << " of " << num_tasks_ << " batches of runs are done\n";
  }

 private:
  const size_t num_tasks_;
  size_t num_done_ = 0;
  absl::Time next_ = absl::Now() + absl::Minutes(1);
};

// Takes the reports that a worker has written. Returns false at their end.
bool TakeReports(Worker& worker, const std::vector<Task>& tasks, CampaignProgress& progress,
                 CampaignReport* report) {
  char bytes[65536];
  const ssize_t size = read(worker.fd, bytes, sizeof(bytes));
  if (size < 0 && errno == EINTR) return true;
  if (size <= 0) return false;
  worker.unread.append(bytes, static_cast<size_t>(size));
  for (size_t end = 0; (end = worker.unread.find('\n')) != std::string::npos;) {
    const auto json = nlohmann::json::parse(worker.unread.substr(0, end));
    worker.unread.erase(0, end + 1);
    const Task& task = tasks[json[0].get<size_t>()];
    const TrialReport trials = FromJson(json);
    report->rows[{task.rehearsal->scenario->name(), task.trials.fault}].Add(trials.counts);
    progress.AddDone();
    for (const std::string& problem : trials.problems) {
      report->problems.push_back(problem);
      std::cerr << problem << '\n';
    }
  }
  return true;
}

absl::Status RunTasks(const std::vector<Task>& tasks, const CampaignOptions& options,
                      CampaignReport* report) {
  std::vector<Worker> workers;
  workers.reserve(options.jobs);
  for (int i = 0; i < options.jobs; ++i) workers.push_back(StartWorker(tasks, options, i));
  std::vector<pollfd> open;
  open.reserve(workers.size());
  for (const Worker& worker : workers) open.push_back({worker.fd, POLLIN, 0});
  CampaignProgress progress(tasks.size());
  for (int left = options.jobs; left > 0;) {
    if (poll(open.data(), open.size(), -1) < 0) continue;
    for (size_t i = 0; i < open.size(); ++i) {
      if (open[i].fd < 0 || open[i].revents == 0) continue;
      if (TakeReports(workers[i], tasks, progress, report)) continue;
      open[i].fd = -1;
      --left;
    }
  }
  absl::Status status;
  for (const Worker& worker : workers) {
    close(worker.fd);
    int code = 0;
    waitpid(worker.pid, &code, 0);
    if (code != 0) status = absl::InternalError("a process of the harness has died");
  }
  return status;
}

std::string RowOf(const std::string& scenario, const std::string& fault, const Counts& counts) {
  return absl::StrFormat("%-16s %-21s %6d %6d %6d %6d %6d %8d %8d %8d\n", scenario, fault,
                         counts.runs, counts.lost, counts.half_done, counts.wrong, counts.wedged,
                         counts.by_itself, counts.by_restart, counts.named);
}

}  // namespace

Counts CampaignReport::Sum() const {
  Counts sum;
  for (const auto& [row, counts] : rows) sum.Add(counts);
  return sum;
}

Counts CampaignReport::SumOf(Fault fault) const {
  Counts sum;
  for (const auto& [row, counts] : rows) {
    if (row.second == fault) sum.Add(counts);
  }
  return sum;
}

absl::StatusOr<CampaignReport> RunCampaign(const CampaignOptions& options) {
  const absl::Cleanup remove = [&] {
    std::error_code error;
    std::filesystem::remove_all(options.folder, error);
  };
  const std::vector<std::unique_ptr<Scenario>> scenarios = MakeScenarios(options.seed);
  CampaignReport report;
  std::vector<std::unique_ptr<Rehearsal>> rehearsals;
  std::vector<Task> tasks;
  for (const auto& scenario : scenarios) {
    if (!IsWanted(options.scenarios, scenario->name())) continue;
    const std::string folder = options.folder + "/rehearsal";
    HYPERMAP_ASSIGN_OR_RETURN(Rehearsal rehearsal, Rehearse(scenario.get(), folder, Plant::kNone));
    if (options.plant != Plant::kNone) {
      HYPERMAP_ASSIGN_OR_RETURN(rehearsal,
                                Rehearse(scenario.get(), folder, options.plant, rehearsal.states));
    }
    rehearsals.push_back(std::make_unique<Rehearsal>(std::move(rehearsal)));
    report.scenarios.push_back(scenario->name());
    report.num_calls += static_cast<int64_t>(rehearsals.back()->calls.size());
    for (Task& task : TasksOf(*rehearsals.back(), options)) tasks.push_back(task);
  }
  // All faults of few trials are seen soon.
  std::stable_sort(tasks.begin(), tasks.end(),
                   [](const Task& a, const Task& b) { return a.trials.first < b.trials.first; });
  HYPERMAP_RETURN_IF_ERROR(RunTasks(tasks, options, &report));
  return report;
}

std::string TableOf(const CampaignReport& report) {
  std::string table = absl::StrFormat("%-16s %-21s %6s %6s %6s %6s %6s %8s %8s %8s\n", "", "", "",
                                      "", "half-", "", "", "by", "by", "");
  absl::StrAppendFormat(&table, "%-16s %-21s %6s %6s %6s %6s %6s %8s %8s %8s\n", "scenario",
                        "fault", "runs", "lost", "done", "wrong", "wedged", "itself", "restart",
                        "named");
  for (const std::string& scenario : report.scenarios) {
    for (int i = 0; i < kNumFaults; ++i) {
      const auto row = report.rows.find({scenario, static_cast<Fault>(i)});
      if (row == report.rows.end()) continue;
      absl::StrAppend(&table, RowOf(scenario, NameOf(row->first.second), row->second));
    }
  }
  for (int i = 0; i < kNumFaults; ++i) {
    const Counts counts = report.SumOf(static_cast<Fault>(i));
    if (counts.runs == 0) continue;
    absl::StrAppend(&table, RowOf("all", NameOf(static_cast<Fault>(i)), counts));
  }
  absl::StrAppend(&table, RowOf("all", "all", report.Sum()));
  return table;
}

}  // namespace hypermap::robustness
