#include <algorithm>
#include <vector>

#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "tests/prove/proofs.h"

namespace hypermap::prove {
namespace {

constexpr double kSlowest = 0.95;
constexpr int64_t kMostMemory = int64_t{64} << 20;

// Edits per second of writers that write for a fixed time.
absl::StatusOr<double> Throughput(Site& site, const Sizes& sizes, uint64_t seed) {
  const int64_t before = site.model().num_edits();
  const absl::Time begin = absl::Now();
  WriterGroup writers(site, sizes.writers,
                      {.edits = 1'000'000'000, .cells = false, .max_things = 50}, seed);
  absl::SleepFor(absl::Seconds(sizes.seconds));
  HYPERMAP_RETURN_IF_ERROR(writers.Stop());
  return static_cast<double>(site.model().num_edits() - before) /
         absl::ToDoubleSeconds(absl::Now() - begin);
}

// The same with a watch that reads the snapshot and nothing after it.
absl::StatusOr<double> ThroughputWatched(Site& site, const Sizes& sizes, uint64_t seed) {
  client::Client client = site.NewClient();
  client::Watcher watcher = client.Watch(kMap);
  if (!watcher.Next()) return watcher.status();
  return Throughput(site, sizes, seed);
}

}  // namespace

absl::StatusOr<Verdict> ProveSlowReader(Site& site, const Sizes& sizes) {
  HYPERMAP_RETURN_IF_ERROR(site.Start());
  // Warms up the server.
  if (auto rate = Throughput(site, sizes, sizes.seed); !rate.ok()) return rate.status();
  std::vector<double> ratios;
  std::vector<int64_t> growth_without, growth_with;
  double without = 0.0, with = 0.0;
  for (int i = 0; i < sizes.pairs; ++i) {
    absl::StatusOr<double> rates[2];
    for (const bool watched : {i % 2 != 0, i % 2 == 0}) {
      const int64_t memory = site.server().ResidentBytes();
      const uint64_t seed = sizes.seed + 10 * i + watched;
      rates[watched] =
          watched ? ThroughputWatched(site, sizes, seed) : Throughput(site, sizes, seed);
      if (!rates[watched].ok()) return rates[watched].status();
      (watched ? growth_with : growth_without).push_back(site.server().ResidentBytes() - memory);
    }
    without += *rates[0] / sizes.pairs;
    with += *rates[1] / sizes.pairs;
    ratios.push_back(*rates[1] / *rates[0]);
  }
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  const int64_t most_growth = *std::max_element(growth_with.begin(), growth_with.end());
  return Verdict{
      {"proof", "slow_reader"},
      {"seed", sizes.seed},
      {"pairs", sizes.pairs},
      {"edits", site.model().num_edits()},
      {"edits_per_s_without", without},
      {"edits_per_s_with", with},
      {"median_ratio", *middle},
      {"rss_bytes", site.server().ResidentBytes()},
      {"most_rss_growth_without", *std::max_element(growth_without.begin(), growth_without.end())},
      {"most_rss_growth_with", most_growth},
      {"holds", (!sizes.judge_speed || *middle >= kSlowest) && most_growth <= kMostMemory}};
}

}  // namespace hypermap::prove
