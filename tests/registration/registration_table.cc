// registration_table: estimates the transform between maps and turned, shifted and cut copies of
// them, and prints how often that was right, ambiguous and wrong. The exit code is 0 if it was
// never wrong, and right often enough.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "base/status/status_macros.h"
#include "map/registration/grid_estimate.h"
#include "tests/registration/test_maps.h"
#include "tests/registration/trial.h"

namespace hypermap::registration {
namespace {

constexpr double kDegrees = 57.29577951308232;

struct Options {
  uint64_t seed = 1;
  int runs = 100;
  bool unrelated = false;
  int every = 1;
  bool verbose = false;
  double least_right = 0.95;
  TrialOptions trial;
};

// The outcomes of the trials of one map.
struct Row {
  int runs = 0;
  int right = 0;
  int ambiguous = 0;
  int wrong = 0;
  // Of those that were right.
  double largest_offset_m = 0.0;
  double largest_yaw_rad = 0.0;
  double mahalanobis = 0.0;
  double seconds = 0.0;

  void Add(const Outcome& outcome) {
    ++runs;
    if (outcome.verdict == Verdict::kAmbiguous) ++ambiguous;
    if (outcome.verdict == Verdict::kWrong) ++wrong;
    if (outcome.verdict != Verdict::kRight) return;
    ++right;
    largest_offset_m = std::max(largest_offset_m, outcome.offset_m);
    largest_yaw_rad = std::max(largest_yaw_rad, outcome.yaw_rad);
    mahalanobis += outcome.mahalanobis;
  }
};

void PrintHeading() {
  std::printf("%-32s %5s %6s %10s %6s %10s %8s %6s %6s\n", "map", "runs", "right", "ambiguous",
              "wrong", "offset_m", "yaw_deg", "d2", "cpu_s");
}

void Print(const std::string& name, const Row& row) {
  std::printf("%-32s %5d %6d %10d %6d %10.4f %8.4f %6.2f %6.2f\n", name.c_str(), row.runs,
              row.right, row.ambiguous, row.wrong, row.largest_offset_m,
              row.largest_yaw_rad * kDegrees, row.mahalanobis / std::max(1, row.right),
              row.seconds / std::max(1, row.runs));
  std::fflush(stdout);
}

void Print(uint64_t seed, const TransformEstimate& estimate, const Outcome& outcome) {
  std::printf(
      "  seed %llu: %s, offset %.4f m, yaw %.4f deg, score %.3f, inliers %.3f, runner-up "
      "%.3f, d2 %.2f\n",
      static_cast<unsigned long long>(seed), std::string(AmbiguityName(estimate.ambiguity)).c_str(),
      outcome.offset_m, outcome.yaw_rad * kDegrees, estimate.best.score, estimate.inlier_share,
      estimate.runner_up ? estimate.runner_up->score : 0.0, outcome.mahalanobis);
}

double ProcessorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

absl::Status RunTrial(const Trial& trial, uint64_t seed, const Options& options, Row* row) {
  const double begin = ProcessorSeconds();
  HYPERMAP_ASSIGN_OR_RETURN(const TransformEstimate estimate,
                            EstimateFromGrids(*trial.source, *trial.target));
  row->seconds += ProcessorSeconds() - begin;
  const Outcome outcome = Compare(estimate, trial.target_from_source);
  row->Add(outcome);
  if (options.verbose) Print(seed, estimate, outcome);
  return absl::OkStatus();
}

absl::Status RunMap(const TestMap& map, const Options& options, Row* row) {
  for (int run = 0; run < options.runs; ++run) {
    const uint64_t seed = options.seed + static_cast<uint64_t>(run);
    HYPERMAP_RETURN_IF_ERROR(
        RunTrial(MakeTrial(map.grid, options.trial, seed), seed, options, row));
  }
  return absl::OkStatus();
}

// Whether they may be maps of one place.
bool AreRelated(const TestMap& a, const TestMap& b) { return a.grid->extent() == b.grid->extent(); }

// Runs trials of copies of each map with each other one, of which no answer is right.
absl::Status RunUnrelated(const std::vector<TestMap>& maps, const Options& options, Row* row) {
  const PlanarTransform nowhere(1e6, 1e6, 0.0);
  int number = 0;
  for (const TestMap& a : maps) {
    for (const TestMap& b : maps) {
      if (AreRelated(a, b)) continue;
      const int pair = number++;
      if (pair % options.every != 0) continue;
      const uint64_t seed = options.seed + static_cast<uint64_t>(pair);
      Trial trial = MakeTrial(a.grid, options.trial, seed);
      (trial.source == a.grid ? trial.source : trial.target) = b.grid;
      trial.target_from_source = nowhere;
      HYPERMAP_RETURN_IF_ERROR(RunTrial(trial, seed, options, row));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<TestMap>> LoadMaps(const std::vector<std::string>& files) {
  std::vector<TestMap> maps;
  for (const std::string& file : files) {
    HYPERMAP_ASSIGN_OR_RETURN(TestMap map, LoadMap(file));
    maps.push_back(std::move(map));
  }
  if (!maps.empty()) return maps;
  if (const char* data = std::getenv("HYPERMAP_DATA")) {
    HYPERMAP_ASSIGN_OR_RETURN(maps, RealMaps(data));
  }
  HYPERMAP_ASSIGN_OR_RETURN(TestMap office, TourOffice());
  maps.push_back(std::move(office));
  return maps;
}

absl::StatusOr<bool> Run(const std::vector<std::string>& files, const Options& options) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<TestMap> maps, LoadMaps(files));
  PrintHeading();
  if (options.unrelated) {
    Row row;
    HYPERMAP_RETURN_IF_ERROR(RunUnrelated(maps, options, &row));
    Print("unrelated", row);
    return row.wrong == 0;
  }
  bool is_good = true;
  for (const TestMap& map : maps) {
    Row row;
    HYPERMAP_RETURN_IF_ERROR(RunMap(map, options, &row));
    Print(map.name, row);
    is_good = is_good && row.wrong == 0 && row.right >= options.least_right * row.runs;
  }
  return is_good;
}

int Main(int argc, char** argv) {
  Options options;
  std::vector<std::string> files;
  CLI::App app("Estimates the transform between maps and copies of them.", "registration_table");
  app.add_option("--seed", options.seed, "Seed of the first run of each map")
      ->capture_default_str();
  app.add_option("--runs", options.runs, "Runs of each map")->capture_default_str();
  app.add_option("--cut", options.trial.cut, "Share of the known cells that a copy lacks")
      ->capture_default_str();
  app.add_option("--changed", options.trial.changed,
                 "Share of the occupied cells that are elsewhere in a copy")
      ->capture_default_str();
  app.add_option("--least_right", options.least_right,
                 "Share of the runs of each map that must be right")
      ->capture_default_str();
  app.add_flag("--unrelated", options.unrelated,
               "Match copies of each map with the other maps, once each: nothing may be found");
  app.add_option("--every", options.every, "With --unrelated, take every n-th pair of maps")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--verbose", options.verbose, "Print each run");
  app.add_option("files", files,
                 ".hmap or nav2 .yaml files; without any, the office of the tour and the maps of "
                 "$HYPERMAP_DATA");
  CLI11_PARSE(app, argc, argv);
  const absl::StatusOr<bool> is_good = Run(files, options);
  if (!is_good.ok()) std::cerr << "registration_table: " << is_good.status() << '\n';
  return is_good.ok() && *is_good ? 0 : 1;
}

}  // namespace
}  // namespace hypermap::registration

int main(int argc, char** argv) {
  try {
    return hypermap::registration::Main(argc, argv);
  } catch (const std::exception& error) {  // of CLI11
    std::cerr << "registration_table: " << error.what() << '\n';
    return 1;
  }
}
