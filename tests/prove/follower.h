// Watches the map, checks the order of the events, and keeps the state that results from them.
#ifndef HYPERMAP_TESTS_PROVE_FOLLOWER_H_
#define HYPERMAP_TESTS_PROVE_FOLLOWER_H_

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/client.h"
#include "tests/prove/model.h"

namespace hypermap::prove {

// Number of wrong events of a follower, by kind.
struct Faults {
  int64_t gaps = 0;      // a revision was not reported
  int64_t repeats = 0;   // a revision was reported again
  int64_t reorders = 0;  // a revision was reported after a later one
  int64_t wrong = 0;     // a revision had wrong changes, or none that were selected

  Faults& operator+=(const Faults& other);
  bool none() const { return gaps + repeats + reorders + wrong == 0; }
};

// Run is called by one thread, Cut by any; the other functions only after Run has returned.
class Follower {
 public:
  // With `coalesce`, it asks for several messages at a time.
  Follower(const client::Client& client, Selection selection, bool coalesce)
      : client_(client), selection_(std::move(selection)), coalesce_(coalesce) {}

  // Watches until revision `*last`, which is negative while it is not known.
  absl::Status Run(const std::atomic<Revision>& last);
  // Breaks the watch. Run resumes it from the last revision.
  void Cut();

  // Compares the events with the model. All must be of one incarnation of the map.
  Faults Check(const Model& model) const;
  // The same for the events of this incarnation only.
  Faults Check(const Model& model, uint64_t incarnation) const;
  const State& state() const { return state_; }
  const Selection& selection() const { return selection_; }
  // Returns whether the first snapshot has arrived.
  bool has_begun() const { return has_begun_; }
  // The incarnation of the map whose events arrive; 0 before the first. Any thread may call this.
  uint64_t incarnation() const { return incarnation_; }
  int num_resumed() const { return num_resumed_; }
  // Number of times that it started again with a snapshot, because the revision to resume from was
  // no longer kept, or the map is another incarnation.
  int num_begun_anew() const { return static_cast<int>(stretches_.size()) - 1; }
  int64_t num_told() const;

 private:
  // A snapshot and the changes that followed it.
  struct Stretch {
    std::optional<Revision> begun_at;
    std::optional<Revision> reached;
    uint64_t incarnation = 0;  // 0 before the first event
    std::vector<ToldRevision> told;
  };

  std::shared_ptr<client::Watcher> Open();
  void Check(const Model& model, const Stretch& stretch, bool is_last, Faults& faults) const;
  absl::Status Take(const client::WatchEvent& event);
  absl::Status Take(const client::MapChange& change, ToldRevision& told);

  client::Client client_;
  const Selection selection_;
  const bool coalesce_;
  State state_;
  std::atomic<bool> has_begun_ = false;
  std::atomic<uint64_t> incarnation_ = 0;
  std::vector<Stretch> stretches_ = std::vector<Stretch>(1);
  int num_resumed_ = 0;
  Mutex mutex_;
  std::shared_ptr<client::Watcher> watcher_ ABSL_GUARDED_BY(mutex_);
};

// Queries the server for the state of a selection at the revision `at`, or at the newest.
absl::StatusOr<State> AskState(client::Client& client, const Selection& selection,
                               std::optional<Revision> at = std::nullopt);

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_FOLLOWER_H_
