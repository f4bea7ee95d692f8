// Counts what was done in a map since it was opened.
#ifndef HYPERMAP_SERVER_SESSION_SESSION_METERS_H_
#define HYPERMAP_SERVER_SESSION_SESSION_METERS_H_

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "map/observations/observe_answers.h"
#include "server/fusion/fold_work.h"

namespace hypermap::server {

// Numbers of commits, observations and the lags of watches. Thread safe, without locks.
class SessionMeters {
 public:
  // Upper bounds of the classes of groups by their commits; the last class has no bound.
  static constexpr std::array<int, 8> kBounds = {1, 2, 5, 10, 20, 50, 100, 500};
  // The same for the lags of watches, by their revisions.
  static constexpr std::array<int, 6> kLagBounds = {1, 10, 100, 1'000, 10'000, 100'000};
  static constexpr size_t kOutcomes = 5;  // of ObservationOutcome

  void AddGroup(int64_t commits, int64_t changes);
  void AddFailedGroup() { failed_groups_.fetch_add(1, std::memory_order_relaxed); }
  void AddObservation(ObservationOutcome outcome) {
    observations_[static_cast<size_t>(outcome)].fetch_add(1, std::memory_order_relaxed);
  }

  // Sets what the folding of observations has cost so far.
  void SetFoldWork(const FoldWork& work);

  // Counts that a watch which is this many revisions behind the newest takes the next ones.
  void AddWatchLag(int64_t revisions);

  struct Reading {
    int64_t commits = 0;
    int64_t changes = 0;
    int64_t failed_groups = 0;
    std::array<int64_t, kBounds.size() + 1> groups = {};   // in each class
    std::array<int64_t, kOutcomes> observations = {};      // by ObservationOutcome
    std::array<int64_t, kLagBounds.size() + 1> lags = {};  // in each class
    int64_t total_lag = 0;                                 // sum of the lags
    FoldWork fold_work;
  };
  Reading Read() const;

 private:
  std::atomic<int64_t> commits_ = 0;
  std::atomic<int64_t> changes_ = 0;
  std::atomic<int64_t> failed_groups_ = 0;
  std::array<std::atomic<int64_t>, kBounds.size() + 1> groups_ = {};
  std::array<std::atomic<int64_t>, kOutcomes> observations_ = {};
  std::array<std::atomic<int64_t>, kLagBounds.size() + 1> lags_ = {};
  std::atomic<int64_t> total_lag_ = 0;
  std::atomic<int64_t> folded_ = 0;
  std::atomic<int64_t> repeated_ = 0;
  std::atomic<int64_t> fold_cpu_ns_ = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_SESSION_METERS_H_
