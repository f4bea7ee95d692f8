// Follows the map, notes all that it is told, and keeps the state that follows from it.
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
#include "absl/synchronization/mutex.h"
#include "client_libs/cpp/client.h"
#include "tests/prove/model.h"

namespace hypermap::prove {

// What is wrong with what a follower was told.
struct Faults {
  int64_t gaps = 0;      // a revision was not told
  int64_t repeats = 0;   // a revision was told again
  int64_t reorders = 0;  // a revision was told after a later one
  int64_t wrong = 0;     // a revision was told that was not to be told, or otherwise

  Faults& operator+=(const Faults& other);
  bool none() const { return gaps + repeats + reorders + wrong == 0; }
};

// Run is for one thread, Cut for any; the rest is for afterwards.
class Follower {
 public:
  // With `coalesce` it asks for several messages at a time.
  Follower(const client::Client& client, Selection selection, bool coalesce)
      : client_(client), selection_(std::move(selection)), coalesce_(coalesce) {}

  // Follows until revision `*last`, which is negative while it is not known.
  absl::Status Run(const std::atomic<Revision>& last);
  // Breaks the watch off. It is resumed by the revision it had.
  void Cut();

  // Compares what was told with the model.
  Faults Check(const Model& model) const;
  const State& state() const { return state_; }
  const Selection& selection() const { return selection_; }
  // Whether it has been told what the map held.
  bool has_begun() const { return has_begun_; }
  int num_resumed() const { return num_resumed_; }
  int64_t num_told() const { return static_cast<int64_t>(told_.size()); }

 private:
  std::shared_ptr<client::Watcher> Open();
  absl::Status Take(const client::WatchEvent& event);
  absl::Status Take(const client::MapChange& change, ToldRevision& told);

  client::Client client_;
  const Selection selection_;
  const bool coalesce_;
  State state_;
  std::optional<Revision> begun_at_;
  std::atomic<bool> has_begun_ = false;
  std::optional<Revision> reached_;
  std::vector<ToldRevision> told_;
  int num_resumed_ = 0;
  absl::Mutex mutex_;
  std::shared_ptr<client::Watcher> watcher_ ABSL_GUARDED_BY(mutex_);
};

// What the map holds for a selection, asked anew of the server. At `at`, or the newest.
absl::StatusOr<State> AskState(client::Client& client, const Selection& selection,
                               std::optional<Revision> at = std::nullopt);

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_FOLLOWER_H_
