// hypermap_robustness: does to the files of maps, outboxes and replicas what disks, kernels and
// power supplies do, and counts what is lost. The last line is one JSON object with the counts and
// "holds". The exit code is 0 if nothing acknowledged was lost, nothing is there by half, no answer
// is wrong, and everything goes on; 77 if the kernel does not allow to see the calls of a process.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/robustness/campaign.h"
#include "tests/robustness/supervisor.h"

namespace hypermap::robustness {
namespace {

constexpr int kSkipped = 77;

const std::map<std::string, Plant>& Plants() {
  static const auto* const plants =
      new std::map<std::string, Plant>{{"folder-sync", Plant::kFolderSyncIsLeftOut},
                                       {"file-sync", Plant::kFileSyncIsLeftOut},
                                       {"failed-sync", Plant::kFailedSyncIsBelieved},
                                       {"early", Plant::kAcknowledgedTooEarly},
                                       {"error", Plant::kErrorIsIgnored},
                                       {"damage", Plant::kDamageWithChecksum}};
  return *plants;
}

// Memory, if there is some, because nothing here needs a disk that keeps its files.
std::string DefaultFolder() {
  constexpr char kMemory[] = "/dev/shm";
  if (access(kMemory, W_OK) == 0) return kMemory;
  return std::filesystem::temp_directory_path();
}

nlohmann::ordered_json VerdictOf(const CampaignOptions& options, const CampaignReport& report,
                                 double seconds) {
  const Counts sum = report.Sum();
  const auto runs = [&](Fault fault) { return report.SumOf(fault).runs; };
  return {{"proof", "robustness"},
          {"seed", options.seed},
          {"seconds", seconds},
          {"scenarios", report.scenarios.size()},
          {"runs", sum.runs},
          {"calls_of_scenarios", report.num_calls},
          {"failed_calls", runs(Fault::kCallFails)},
          {"kills", runs(Fault::kKill) + runs(Fault::kBitFlipAfterKill)},
          {"power_losses", runs(Fault::kPowerLoss) + runs(Fault::kPowerLossAfterFailedSync) +
                               runs(Fault::kPowerLossInRecovery)},
          {"bit_flips", runs(Fault::kBitFlip) + runs(Fault::kBitFlipAfterKill)},
          {"acknowledged_lost", sum.lost},
          {"half_done", sum.half_done},
          {"wrong_answers", sum.wrong},
          {"wedged", sum.wedged},
          {"recovered_by_itself", sum.by_itself},
          {"recovered_by_restart", sum.by_restart},
          {"damage_named", sum.named},
          {"holds", sum.runs > 0 && sum.failures() == 0}};
}

int Main(int argc, char** argv) {
  CampaignOptions options;
  options.folder = DefaultFolder();
  // Most of a run is waiting, for the supervisor or for the disk.
  options.jobs = 4 * static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  std::string plant;
  CLI::App app("Injects faults into all code that writes files, and counts what is lost.",
               "hypermap_robustness");
  app.add_option("--seed", options.seed, "Random seed; repeats a run")->capture_default_str();
  app.add_flag("--short", options.is_short, "Some of the trials, in about a minute");
  app.add_flag(
      "--every_call", options.every_call,
      "Let every call fail, also those that are alike: of one kind, for one file, in one step");
  app.add_option("--scenario", options.scenarios, "Only this scenario; may be repeated");
  app.add_option("--fault", options.faults, "Only this fault; may be repeated");
  app.add_option("--trial", options.trial,
                 "Only the trial of this number, and those of its batch; with --scenario, --fault");
  app.add_option("--jobs", options.jobs, "Number of processes")->check(CLI::PositiveNumber);
  app.add_option("--folder", options.folder, "Where the files of the runs are made")
      ->check(CLI::ExistingDirectory);
  app.add_option("--plant", plant, "Make a mistake on purpose, which must be found")
      ->check(CLI::IsMember(Plants()));
  CLI11_PARSE(app, argc, argv);

  if (const absl::Status status = CheckSupervision(); !status.ok()) {
    std::cout << "skipped: " << status.message() << std::endl;
    return kSkipped;
  }
  if (!plant.empty()) options.plant = Plants().at(plant);
  options.folder += "/hypermap_robustness." + std::to_string(getpid());
  std::cout << "seed " << options.seed << std::endl;
  const auto begin = std::chrono::steady_clock::now();
  const absl::StatusOr<CampaignReport> report = RunCampaign(options);
  if (!report.ok()) {
    std::cerr << "hypermap_robustness: " << report.status() << '\n';
    std::cout << nlohmann::ordered_json{{"proof", "robustness"},
                                        {"error", report.status().ToString()},
                                        {"holds", false}}
              << std::endl;
    return 1;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  const nlohmann::ordered_json verdict = VerdictOf(options, *report, took.count());
  std::cout << TableOf(*report) << verdict << std::endl;
  const bool holds = verdict.at("holds").get<bool>();
  if (plant.empty()) return holds ? 0 : 1;
  std::cout << "the planted mistake was " << (holds ? "not " : "") << "found" << std::endl;
  return holds ? 1 : 0;
}

}  // namespace
}  // namespace hypermap::robustness

int main(int argc, char** argv) {
  try {
    return hypermap::robustness::Main(argc, argv);
  } catch (const std::exception& error) {  // of CLI11 and the JSON library
    std::cerr << "hypermap_robustness: " << error.what() << '\n';
    return 1;
  }
}
