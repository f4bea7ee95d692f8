#include "client_libs/bench/followers.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <thread>
#include <utility>

#include "absl/time/clock.h"
#include "base/sync/deadline.h"
#include "client_libs/testing/scripted_server.h"

namespace hypermap::bench {
namespace {

// A watch that reports one change in each of the revisions, and then ends with an error.
client::ScriptedWatch WatchOf(std::initializer_list<Revision> revisions) {
  client::ScriptedWatch watch;
  watch.status = grpc::Status(grpc::StatusCode::FAILED_PRECONDITION, "the end");
  for (const Revision revision : revisions) {
    v1::WatchResponse& response = watch.responses.emplace_back();
    response.set_revision(revision);
    response.mutable_time()->set_seconds(1);
    v1::Change* change = response.add_changes();
    change->set_kind(v1::CHANGE_KIND_REMOVE);
    change->set_layer("objects");
    change->set_object_id(7);
  }
  return watch;
}

// Runs a watcher from revision 4 until it has reached the revision. The last watch stays open.
WatchFaults FaultsOf(std::vector<client::ScriptedWatch> watches, Revision until) {
  client::Script script;
  script.watches = std::move(watches);
  script.watches.back().stays = true;
  client::ScriptedServer server(script);
  RevisionTimes times(4);
  OutageLog outages;
  const std::string map = "site";
  WatchWorker worker(OperationKind::kWatchDelivery, {map, 4, 0, times, outages},
                     client::Client(server.address()));
  worker.recorder().Start({});
  EXPECT_TRUE(worker.Open().ok());
  std::thread thread([&worker] { worker.Run({}); });
  const Deadline deadline(absl::Seconds(30));
  while (worker.track().last() < until && !deadline.has_passed()) {
    absl::SleepFor(absl::Milliseconds(1));
  }
  worker.Stop();
  thread.join();
  EXPECT_EQ(worker.track().last(), until);
  return worker.track().faults();
}

TEST(WatchWorkerTest, RevisionsInOrderHaveNoFaults) {
  const WatchFaults faults = FaultsOf({WatchOf({5, 6, 7})}, 7);
  EXPECT_EQ(faults.repeated, 0);
  EXPECT_EQ(faults.reordered, 0);
}

TEST(WatchWorkerTest, OrderThatTheClientLibraryRefusesIsAFault) {
  EXPECT_EQ(FaultsOf({WatchOf({5, 5}), WatchOf({6})}, 6).reordered, 1);
  EXPECT_EQ(FaultsOf({WatchOf({6, 5}), WatchOf({7})}, 7).reordered, 1);
}

TEST(WatchWorkerTest, RevisionThatComesAgainOnTheNextStreamIsAFault) {
  EXPECT_EQ(FaultsOf({WatchOf({5, 6}), WatchOf({6, 7})}, 7).repeated, 1);
}

}  // namespace
}  // namespace hypermap::bench
