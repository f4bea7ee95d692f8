// Clients that follow the map: watchers and replicas.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_FOLLOWERS_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_FOLLOWERS_H_

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "client_libs/bench/outages.h"
#include "client_libs/bench/revisions.h"
#include "client_libs/bench/worker.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/replica/replica.h"

namespace hypermap::bench {

// The map and the records that all followers share. They outlive the followers.
struct Following {
  const std::string& map;
  // Followers report the changes after it. Its incarnation is that of the map.
  Revision start = 0;
  uint64_t incarnation = 0;
  RevisionTimes& times;
  OutageLog& outages;
};

// Receives the changes of the whole map, with coalesced messages, and checks the order of
// revisions. It only counts the changes, so that one machine can be many followers. Delivery of
// a revision is measured from its time by the server's clock, so that the clocks of both machines
// must agree.
//
// kWatchDelivery: it watches as a dashboard does (Client::Watch), which resumes by itself.
// kReplicaDelivery: it makes the call of a replica (Client::Replicate), and does not apply the
// changes. A stream that ends is opened again after the last revision.
class WatchWorker final : public Worker {
 public:
  WatchWorker(OperationKind kind, const Following& following, client::Client client);

  absl::Status Open() override;
  void Run(const RunTimes& times) override;
  void Stop() override;

  // Thread safe.
  const WatchTrack& track() const { return track_; }

 private:
  // `num_resumed` is that of the watcher.
  void Take(const client::WatchEvent& event, int num_resumed);
  client::Watcher Call();
  // Notes an end that was not asked for, and waits before the next attempt.
  void NoteEnd(const absl::Status& why, absl::Duration pause);
  bool is_stopped() const;

  const Following following_;
  client::Client client_;
  const int outage_client_;
  WatchTrack track_;
  int num_resumed_ = 0;
  mutable Mutex mutex_;
  CondVar stop_;
  bool stopped_ ABSL_GUARDED_BY(mutex_) = false;
  // Replaced by the worker's thread only.
  std::unique_ptr<client::Watcher> watcher_ ABSL_GUARDED_BY(mutex_);
};

// A full replica: it applies the changes of the whole map to a copy in `folder`, or in memory if
// that is empty. Its lag runs from the time of a revision, by the server's clock, until the replica
// answers at it.
class ReplicaWorker final : public Worker {
 public:
  ReplicaWorker(const Following& following, client::Client client, std::string folder);

  absl::Status Open() override;
  void Run(const RunTimes& times) override;
  void Stop() override { stopped_ = true; }

  // The revision that the replica has reached. Thread safe.
  Revision revision() const { return revision_; }
  // The replica's layers. REQUIRES: Open has succeeded.
  client::LayerList ListLayers() const { return replica_->ListLayers(); }
  int num_taken_anew() const { return replica_->state().num_taken_anew; }

 private:
  struct Arrival {
    Revision revision;
    absl::Time time;  // by this machine's clock
    SteadyTime moment;
  };

  void NoteArrivals(Revision revision);
  // Records the arrivals of the revisions whose times are known by now.
  void RecordArrivals();
  void NoteBreaks();

  const Following following_;
  client::Client client_;
  const std::string folder_;
  const int outage_client_;
  std::unique_ptr<client::Replica> replica_;
  std::deque<Arrival> arrivals_;  // to be recorded
  int num_breaks_ = 0;
  std::atomic<Revision> revision_ = 0;
  std::atomic<bool> stopped_ = false;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_FOLLOWERS_H_
