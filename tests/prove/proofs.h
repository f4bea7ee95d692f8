// The proofs: what each drives, and the counts that it ends with.
#ifndef HYPERMAP_TESTS_PROVE_PROOFS_H_
#define HYPERMAP_TESTS_PROVE_PROOFS_H_

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/status/statusor.h"
#include "tests/prove/site.h"

namespace hypermap::prove {

// Sizes. Each proof uses those that it speaks of.
struct Sizes {
  uint64_t seed = 1;
  int writers = 4;
  int edits = 25'000;  // of each writer
  int watchers = 20;   // half of them are cut and resumed every second
  int queries = 1'000;
  int kills = 200;
  int history = 0;  // revisions that the server keeps; 0: as many as it does by itself
  int pairs = 11;
  double seconds = 2.0;     // of one run of a pair
  double outage = 60.0;     // seconds without a server
  int queued = 600;         // edits and observations that are put meanwhile
  bool judge_speed = true;  // else it is told, and "holds" does not depend on it
};

// The counts, with "holds". An error where the proof could not be driven to its end.
using Verdict = nlohmann::ordered_json;

// Watchers are told each change once, in order, also over breaks, and end where the map is.
absl::StatusOr<Verdict> ProveFeed(Site& site, const Sizes& sizes);
// Answers of the past are those of then, and cost little more than those of now.
absl::StatusOr<Verdict> ProveAsOf(Site& site, const Sizes& sizes);
// Nothing that was acknowledged is lost, and no batch is done by half, when the server is killed.
absl::StatusOr<Verdict> ProveKill(Site& site, const Sizes& sizes);
// A watcher that does not read costs the writers nothing, and the server little memory.
absl::StatusOr<Verdict> ProveSlowReader(Site& site, const Sizes& sizes);
// A replica answers without a server what the server answered, and is like it afterwards; what was
// queued meanwhile arrives once, in order.
absl::StatusOr<Verdict> ProveReplica(Site& site, const Sizes& sizes);
// A request that is sent again changes the map once.
absl::StatusOr<Verdict> ProveOnce(Site& site, const Sizes& sizes);

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_PROOFS_H_
