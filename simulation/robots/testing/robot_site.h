// A server with a drawn map, for tests of robots.
#ifndef HYPERMAP_SIMULATION_ROBOTS_TESTING_ROBOT_SITE_H_
#define HYPERMAP_SIMULATION_ROBOTS_TESTING_ROBOT_SITE_H_

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "base/time/testing/manual_clock.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/replica/testing/site_server.h"
#include "server/session/testing/memory_map_store.h"
#include "simulation/robots/testing/drawn_site.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::robots {

// Serves the map "site" with the drawn layer "occupancy", from memory. Its clock advances only by
// Advance(), so that no lease ends before. `delay` is added to each commit.
class RobotSite {
 public:
  RobotSite(const std::vector<std::string>& lines, double resolution_m,
            absl::Duration delay = absl::ZeroDuration())
      : machine_(delay) {
    server_.MakeMap("site", {{CreateLayer{DrawnSpec(resolution_m)}, DrawnCells(lines)}});
  }
  ~RobotSite() {
    disk_.Release();
    Stop();
  }

  // Returns HOST:PORT.
  const std::string& address() const { return server_.address(); }
  client::Client NewClient() const {
    return client::Client(address(), {.retry_for = absl::Seconds(10)});
  }

  // Ends all calls at once, and returns when the batches that have queued are committed.
  void Stop() { server_.Stop(absl::ZeroDuration()); }
  void Start() { server_.Start(Options()); }

  absl::Time Now() { return machine_.ManualClock::Wall(); }
  void Advance(absl::Duration by) {
    machine_.Advance(by);
    // The writer reads the clock after any work.
    EXPECT_TRUE(session()->ReadRobotClocks().ok());
  }

  server::MemoryDisk& disk() { return disk_; }
  SnapshotPtr snapshot() { return server_.SnapshotOf("site"); }
  void Edit(const hypermap::Edit& edit) { server_.Edit("site", {{edit}}); }

  // Returns the sequences of a robot's observations in a layer, in the order of their stamps.
  std::vector<int64_t> SequencesIn(const std::string& layer, const std::string& robot) {
    const auto log = session()->ReadEvidence(layer, {}, std::numeric_limits<int>::max());
    EXPECT_TRUE(log.ok()) << log.status();
    std::vector<int64_t> sequences;
    if (!log.ok()) return sequences;
    for (const server::Evidence& evidence : *log) {
      if (!evidence.observation || evidence.observation->robot != robot) continue;
      sequences.push_back(evidence.observation->sequence);
    }
    return sequences;
  }

 private:
  std::shared_ptr<server::MapSession> session() { return *server_.site().Find("site"); }

  // Reading it takes the delay.
  class SlowClock : public ManualClock {
   public:
    explicit SlowClock(absl::Duration delay) : ManualClock(absl::Now()), delay_(delay) {}
    absl::Time Wall() const override {
      absl::SleepFor(delay_);
      return ManualClock::Wall();
    }

   private:
    const absl::Duration delay_;
  };

  server::SessionOptions Options() {
    server::SessionOptions options;
    options.clock = std::make_shared<ServerClock>(&machine_);
    return options;
  }

  hypermap::testing::TemporaryFolder scratch_;
  server::MemoryDisk disk_;
  SlowClock machine_;
  client::SiteServer server_{scratch_.path(),
                             [this] { return std::make_unique<server::MemoryMapStore>(&disk_); },
                             Options()};
};

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_TESTING_ROBOT_SITE_H_
