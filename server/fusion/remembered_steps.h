// What the folds of a log's newest observations computed.
#ifndef HYPERMAP_SERVER_FUSION_REMEMBERED_STEPS_H_
#define HYPERMAP_SERVER_FUSION_REMEMBERED_STEPS_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>

#include "map/fusion/strategy.h"
#include "map/observations/observation.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

// A late observation makes all that are newer be folded again, but most of these find around them
// what they found before: their steps are repeated (Strategy::FoldAgain). Only a cache: the fold is
// the same without it. Keeps the steps of the newest keys. All steps must be of one strategy with
// the same parameters. Not thread safe.
class RememberedSteps {
 public:
  static constexpr size_t kMostSteps = 512;

  explicit RememberedSteps(int64_t max_bytes) : max_bytes_(max_bytes) {}

  // The step of the observation; null if it is not known. An observation is known by its address,
  // since a correction of poses makes another one of it.
  fusion::FoldStepPtr Find(const storage::LogKey& key, const Observation& observation) const;
  // Remembers a step, perhaps in place of another one. Null forgets it.
  void Set(const storage::LogKey& key, std::shared_ptr<const Observation> observation,
           fusion::FoldStepPtr step);
  // Notes whether a known step could be repeated.
  void Count(bool repeated) { share_repeated_ += ((repeated ? 1.0 : 0.0) - share_repeated_) / 64; }

  // Folds that going over these steps costs, as an estimate from those that could be repeated
  // lately: the steps after the key, of which there are so many.
  double FoldsFor(int64_t steps) const {
    return static_cast<double>(steps) * (1.0 - share_repeated_ + share_repeated_ / kStepsPerFold);
  }
  size_t NumAfter(const storage::LogKey& key) const;

  int64_t bytes() const { return bytes_; }

 private:
  // Steps that can be repeated in the time of a fold.
  static constexpr double kStepsPerFold = 16.0;

  struct Remembered {
    std::shared_ptr<const Observation> observation;
    fusion::FoldStepPtr step;
    int64_t bytes = 0;
  };
  using Steps = std::map<storage::LogKey, Remembered>;
  void Erase(Steps::iterator step);

  const int64_t max_bytes_;
  Steps steps_;
  int64_t bytes_ = 0;
  double share_repeated_ = 1.0;  // of known steps, a moving average
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_REMEMBERED_STEPS_H_
