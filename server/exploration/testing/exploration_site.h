// A map for tests of explorations, drawn as text.
#ifndef HYPERMAP_SERVER_EXPLORATION_TESTING_EXPLORATION_SITE_H_
#define HYPERMAP_SERVER_EXPLORATION_TESTING_EXPLORATION_SITE_H_

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/time/testing/manual_clock.h"
#include "map/exploration/exploration_objects.h"
#include "map/exploration/floor_plan.h"
#include "map/exploration/viewshed.h"
#include "server/exploration/map_explorations.h"
#include "server/session/map_session.h"
#include "server/session/testing/memory_map_store.h"

namespace hypermap::server {

inline Polygon Rectangle(double x_min, double y_min, double x_max, double y_max) {
  return Polygon::FromBox({{x_min, y_min}, {x_max, y_max}});
}

// The session of a map with a clock that the test sets, and simulated robots.
class ExplorationSite {
 public:
  static constexpr double kResolution_m = 0.5;
  static constexpr int64_t kMaxExplorationBytes = int64_t{1} << 30;

  ExplorationSite() {
    options_.clock = std::make_shared<ServerClock>(&machine_);
    MemoryMapStore store(&disk_);
    EXPECT_TRUE(store.Create({"site", "map", Now(), ""}).ok());
    Reopen();
  }

  // Closes and opens the map, as a restart of the server does.
  void Reopen() {
    explorations_.reset();
    session_.reset();
    MemoryMapStore store(&disk_);
    auto stored = store.Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    auto session = MapSession::Start(*std::move(stored), options_);
    ASSERT_TRUE(session.ok()) << session.status();
    session_ = *std::move(session);
    explorations_ = std::make_unique<MapExplorations>(session_.get(), room());
  }

  // Takes effect with the next Reopen.
  void set_max_exploration_cells(int64_t cells) { max_exploration_cells_ = cells; }
  admission::Budget& exploration_bytes() { return exploration_bytes_; }
  MapSession& session() { return *session_; }
  MapExplorations& explorations() { return *explorations_; }
  ExplorationRoom room() { return {max_exploration_cells_, &exploration_bytes_}; }
  SnapshotPtr snapshot() const { return session_->snapshot(); }

  absl::Time Now() const { return machine_.Wall(); }
  // Lets time pass without waking the map's writer, so that expired objects stay for now.
  void Advance(absl::Duration by) { machine_.Advance(by); }
  ManualClock& machine() { return machine_; }

  storage::Receipt Submit(EditBatch batch, const std::string& request_id = "") {
    const auto receipt = session_->SubmitAndWait({std::move(batch), "test", request_id});
    EXPECT_TRUE(receipt.ok()) << receipt.status();
    return receipt.ok() ? *receipt : storage::Receipt();
  }

  // Creates the occupancy layer "walls": '#' is occupied, '?' unknown, any other character free.
  // The first line is the top row; the lower left cell is (0, 0), at the origin.
  void Draw(const std::vector<std::string>& lines) {
    LayerSpec spec;
    spec.name = "walls";
    spec.kind = LayerKind::kOccupancy;
    spec.grid = GridGeometry{PlanarTransform(), kResolution_m};
    rows_ = static_cast<int32_t>(lines.size());
    cols_ = static_cast<int32_t>(lines.front().size());
    WriteCells write{"walls", {0, rows_, 0, cols_}, {}};
    for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
      for (const char c : *line) {
        write.values.push_back(c == '?' ? std::nullopt : std::optional<double>(c == '#'));
      }
    }
    Submit({{CreateLayer{spec}, std::move(write)}});
  }
  // Creates an occupancy layer whose cells [0, side) x [0, side) are free.
  void DrawFree(const std::string& layer, double resolution_m, int32_t side) {
    LayerSpec spec;
    spec.name = layer;
    spec.kind = LayerKind::kOccupancy;
    spec.grid = GridGeometry{PlanarTransform(), resolution_m};
    Submit({{CreateLayer{spec}}});
    Write({0, side, 0, side}, 0.0, layer);
  }
  void Write(const CellBox& box, std::optional<double> value, const std::string& layer = "walls") {
    Submit({{WriteCells{layer, box, std::vector(box.num_cells(), value)}}});
  }
  void MarkExplored(const CellBox& box) { Write(box, 1.0, "seen"); }

  // A request to explore all that was drawn, by robots without extent that see 4 m.
  ExplorationStart WholeArea() const {
    ExplorationStart request;
    request.area = Rectangle(0, 0, cols_ * kResolution_m, rows_ * kResolution_m);
    request.occupancy_layer = "walls";
    request.exploration_layer = "seen";
    request.robot_radius_m = 0.0;
    request.author = "test";
    return request;
  }

  ClaimAnswer Claim(const std::string& robot, const Point& place,
                    absl::Duration lease = absl::Minutes(1), ObjectId exploration = 0) {
    const auto answer = explorations().Claim({exploration, robot, place, "", lease, "test"});
    EXPECT_TRUE(answer.ok()) << answer.status();
    return answer.ok() ? *answer : ClaimAnswer();
  }
  // Releases the robot's goal in the newest exploration.
  void Release(const std::string& robot, GoalOutcome outcome) {
    for (const ExplorationGoal& goal : Goals()) {
      if (goal.robot != robot) continue;
      const auto answer = explorations().Release({robot, goal.id, outcome, "test"});
      EXPECT_TRUE(answer.ok()) << answer.status();
    }
  }

  // The newest exploration, in the frame of its layer.
  ExplorationObjects Newest() {
    const auto list = explorations().List("");
    EXPECT_TRUE(list.ok()) << list.status();
    return list.ok() && !list->explorations.empty() ? list->explorations.front()
                                                    : ExplorationObjects();
  }
  std::vector<ExplorationGoal> Goals() { return Newest().goals; }
  Explorer::Progress Progress(ObjectId exploration = 0) {
    const auto report = explorations().Get(exploration, "");
    EXPECT_TRUE(report.ok()) << report.status();
    return report.ok() ? report->progress.cells : Explorer::Progress();
  }

  // Marks the cells that can be seen from a place on floor as explored.
  void LookRound(const Point& place, double range_m) {
    const SnapshotPtr now = snapshot();
    const auto& walls = dynamic_cast<const GridLayer&>(*now->FindLayer("walls"));
    const FloorPlan plan = ReadFloorPlan(walls, walls.extent());
    ViewshedRays rays(static_cast<int32_t>(std::lround(range_m / kResolution_m)));
    EditBatch batch;
    rays.ForEachVisible(plan, *walls.geometry().CellAt(place), [&](const CellIndex& cell) {
      batch.edits.push_back(
          WriteCells{"seen", {cell.row, cell.row + 1, cell.col, cell.col + 1}, {1.0}});
    });
    Submit(std::move(batch));
  }

  struct Robot {
    std::string name;
    Point place;
  };
  // Lets the robots claim and reach goals in turns until the newest exploration ends. Returns the
  // number of goals.
  int Explore(std::vector<Robot> robots, double range_m) {
    constexpr int kMostGoals = 200;
    for (int goals = 0; goals < kMostGoals;) {
      for (Robot& robot : robots) {
        const ClaimAnswer answer = Claim(robot.name, robot.place);
        if (answer.state == ExplorationState::kEnded) return goals;
        if (!answer.goal) continue;
        ++goals;
        robot.place = Centroid(answer.goal->cell);
        LookRound(robot.place, range_m);
        Release(robot.name, GoalOutcome::kReached);
      }
    }
    ADD_FAILURE() << "it does not end";
    return kMostGoals;
  }

 private:
  MemoryDisk disk_;
  ManualClock machine_;
  SessionOptions options_;
  std::unique_ptr<MapSession> session_;
  int64_t max_exploration_cells_ = 25'000'000;
  admission::Budget exploration_bytes_{
      "max_exploration_bytes", kMaxExplorationBytes, {.whole_for_one_client = true}};
  std::unique_ptr<MapExplorations> explorations_;
  int32_t rows_ = 0;
  int32_t cols_ = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_TESTING_EXPLORATION_SITE_H_
