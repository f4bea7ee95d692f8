// The proofs: the load that each applies, and the counts that it returns.
#ifndef HYPERMAP_TESTS_PROVE_PROOFS_H_
#define HYPERMAP_TESTS_PROVE_PROOFS_H_

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/status/statusor.h"
#include "tests/prove/site.h"

namespace hypermap::prove {

// Sizes of the load. Each proof uses those that apply to it.
struct Sizes {
  uint64_t seed = 1;
  int writers = 4;
  int edits = 25'000;  // per writer
  int watchers = 20;   // half of them are cut and resumed every second
  int queries = 1'000;
  int kills = 200;
  int history = 0;  // revisions that the server keeps; 0: its default
  int pairs = 11;
  double seconds = 2.0;     // of one run of a pair
  double outage = 60.0;     // time without a server, seconds
  int queued = 600;         // edits and observations put during the outage
  bool judge_speed = true;  // whether "holds" depends on the measured speed
};

// The counts and "holds". A proof returns an error only if it could not be carried out.
using Verdict = nlohmann::ordered_json;

// Watches report each change once and in order, also across breaks, and end at the state of the
// map.
absl::StatusOr<Verdict> ProveFeed(Site& site, const Sizes& sizes);
// Queries of the past give the answers of that time, and cost little more than current ones.
absl::StatusOr<Verdict> ProveAsOf(Site& site, const Sizes& sizes);
// When the server is killed, no acknowledged edit is lost and no batch is applied partly.
absl::StatusOr<Verdict> ProveKill(Site& site, const Sizes& sizes);
// A watch that is not read does not slow the writers, and costs the server little memory.
absl::StatusOr<Verdict> ProveSlowReader(Site& site, const Sizes& sizes);
// Without a server, a replica gives the answers that the server gave. Afterwards it equals the
// server again, and the queued edits and observations have arrived once, in order.
absl::StatusOr<Verdict> ProveReplica(Site& site, const Sizes& sizes);
// A backup that is made while the map is edited is the map at its revision, also on another server,
// with its history. Restored in place of the map, it makes watches and replicas begin anew, which
// then equal the map.
absl::StatusOr<Verdict> ProveRestore(Site& site, const Sizes& sizes);
// A request that is retried changes the map once.
absl::StatusOr<Verdict> ProveOnce(Site& site, const Sizes& sizes);

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_PROOFS_H_
