// The fold of a log together with late observations that it does not have yet.
#ifndef HYPERMAP_SERVER_FUSION_LATE_FOLD_H_
#define HYPERMAP_SERVER_FUSION_LATE_FOLD_H_

#include <map>
#include <memory>
#include <set>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/observations/observation.h"
#include "server/fusion/evidence_log.h"
#include "server/fusion/log_fold.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

// A late observation makes everything after it be folded again, which may take minutes. Here it is
// done in advance and in short steps, between which the log may grow and change:
//   1. Continue, until it has come to the end of the log.
//   2. Changed, for each change of the log meanwhile.
//   3. Arrived, for each late observation that the log gets.
//   4. Take, for the fold of the log as it is then.
// Not thread safe.
class LateFold {
 public:
  // An observation as the log will have it, and its encoded form.
  struct Late {
    std::shared_ptr<const Observation> observation;
    std::string body;
  };

  // `start` is the fold of the log up to an entry before all of `late`, which must not be empty.
  LateFold(LogFold start, std::map<storage::LogKey, Late> late);

  // Folds entries until `stop`, which is asked after each, returns true. Returns whether the end of
  // the log was reached. Errors as EvidenceLog::Visit.
  absl::StatusOr<bool> Continue(const EvidenceLog& log, absl::FunctionRef<bool()> stop);

  // The log has changed at `key`: forgets the states from there on. False if it has none before, so
  // that this must not be used any more.
  bool Changed(const storage::LogKey& key);
  // The log got the observation `key`, encoded as `body`. If that is not one of the late ones, it
  // is a change like others, whose result is returned.
  bool Arrived(const storage::LogKey& key, absl::string_view body);

  // Returns whether any of the late observations have arrived.
  bool has_arrivals() const { return awaited_.size() < late_.size(); }
  // The newest state that counts only observations that the log has, and the checkpoints before it;
  // null if there is none. REQUIRES: has_arrivals(). Call it once.
  const LogFold* Take();

  const LogFold& fold() const { return fold_; }
  // Entries that were folded from the start to where the fold is now.
  int64_t num_folded() const { return fold_.tip().position - start_; }

 private:
  LogFold fold_;
  const int64_t start_;  // position of fold_ at the start
  const std::map<storage::LogKey, Late> late_;
  std::set<storage::LogKey> awaited_;  // those of late_ that the log does not have
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_LATE_FOLD_H_
