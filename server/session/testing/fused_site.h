// A session of a map with a fused layer, for tests.
#ifndef HYPERMAP_SERVER_SESSION_TESTING_FUSED_SITE_H_
#define HYPERMAP_SERVER_SESSION_TESTING_FUSED_SITE_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "server/fusion/testing/tally_strategy.h"
#include "server/services/evidence_codec.h"
#include "server/session/map_session.h"
#include "server/session/testing/memory_map_store.h"

namespace hypermap::server {

using Verdicts = absl::StatusOr<std::vector<ObservationVerdict>>;

inline const absl::Time kBegin = absl::FromUnixSeconds(1'700'000'000);

// An observation of one object for each label, whose place follows from the label's length.
inline Observation Sighting(const std::string& robot, int64_t sequence, double at_s,
                            const std::vector<std::string>& labels) {
  Observation observation;
  observation.robot = robot;
  observation.sequence = sequence;
  observation.stamp = kBegin + absl::Seconds(at_s);
  for (const std::string& label : labels) {
    Detection detection;
    detection.scores = {{label, 0.9}};
    const double x = 2.0 * label.size() + 0.001 * static_cast<double>(sequence);
    detection.hull = Polygon::FromBox({{x, 0}, {x + 1, 1}});
    detection.num_points = 5;
    observation.detections.push_back(detection);
  }
  const double x = static_cast<double>(sequence % 50);
  observation.free_space = Polygon::FromBox({{x, 0}, {x + 2, 2}});
  return observation;
}

// The objects of the layer "things", sorted by label and without ids.
inline std::vector<SemanticObject> ObjectsOf(const Snapshot& snapshot) {
  const auto* layer = snapshot.FindSemantic("things");
  std::vector<SemanticObject> objects;
  for (const ObjectPtr& object : layer->Objects()) {
    objects.push_back(*object);
    objects.back().id = 0;
  }
  std::sort(objects.begin(), objects.end(),
            [](const auto& a, const auto& b) { return a.label < b.label; });
  return objects;
}

inline std::vector<CellIndex> ExploredCells(const Snapshot& snapshot) {
  const auto* grid = snapshot.FindGrid("seen");
  std::vector<CellIndex> cells;
  const CellBox& box = grid->extent();
  for (int32_t row = box.row_begin; row < box.row_end; ++row) {
    for (int32_t col = box.col_begin; col < box.col_end; ++col) {
      if (grid->ValueAt({row, col}) == 1.0) cells.push_back({row, col});
    }
  }
  return cells;
}

inline EditBatch ThingsAndSeen() {
  LayerSpec things;
  things.name = "things";
  LayerSpec seen;
  seen.name = "seen";
  seen.kind = LayerKind::kExploration;
  seen.grid = GridGeometry{PlanarTransform(), 0.5};
  return {{CreateLayer{things}, CreateLayer{seen}}};
}

// A session of a map with the empty layers "things" and "seen", in a store of its own.
class FusedSite {
 public:
  FusedSite() {
    options_.max_group_time = absl::InfiniteDuration();
    options_.fusion.codec = WireEvidenceCodec();
    options_.fusion.make_strategy = MakeTallyStrategy;
    options_.fusion.default_strategy = "tally";
    options_.fusion.entries_per_checkpoint = 4;
    options_.fusion.entries_per_stored_checkpoint = 10;
    MemoryMapStore store(&disk_);
    EXPECT_TRUE(store.Create({"site", "map", absl::UnixEpoch(), ""}).ok());
    Restart();
    EXPECT_TRUE(session_->SubmitAndWait(Submission{ThingsAndSeen(), "test", ""}).ok());
  }

  void Restart() {
    session_.reset();
    MemoryMapStore store(&disk_);
    auto stored = store.Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    auto session = MapSession::Start(*std::move(stored), options_);
    ASSERT_TRUE(session.ok()) << session.status();
    session_ = *std::move(session);
  }

  absl::StatusOr<storage::Receipt> Run(FusionCommand command, const std::string& id = "") {
    return session_->RunAndWait(FusionSubmission{std::move(command), "test", id});
  }
  void Start(const std::string& strategy = "") {
    const auto receipt = Run(StartFusion{"things", {strategy, "", "seen"}});
    EXPECT_TRUE(receipt.ok()) << receipt.status();
  }

  std::future<Verdicts> Submit(std::vector<Observation> observations) {
    return Submit(ObservationSubmission{"things", std::move(observations), "test"});
  }
  std::future<Verdicts> Submit(ObservationSubmission submission) {
    auto promise = std::make_shared<std::promise<Verdicts>>();
    session_->Observe(std::move(submission),
                      [promise](Verdicts verdicts) { promise->set_value(std::move(verdicts)); });
    return promise->get_future();
  }
  // Submits one observation and waits for its verdict.
  ObservationVerdict Observe(const Observation& observation) {
    Verdicts verdicts = Submit({observation}).get();
    EXPECT_TRUE(verdicts.ok()) << verdicts.status();
    return verdicts.ok() ? verdicts->front() : ObservationVerdict();
  }
  absl::StatusOr<storage::Receipt> Edit(EditBatch batch) {
    return session_->SubmitAndWait(Submission{std::move(batch), "test", ""});
  }

  // The author of the newest revision.
  std::string Author() {
    auto history = session_->OpenHistory();
    EXPECT_TRUE(history.ok()) << history.status();
    const Revision newest = snapshot()->revision;
    const auto records = (*history)->Revisions(newest - 1, newest + 1, false, 1);
    EXPECT_TRUE(records.ok()) << records.status();
    return records->front().author;
  }

  SnapshotPtr snapshot() const { return session_->snapshot(); }
  ObjectPtr Find(const std::string& label) const {
    const auto* layer = snapshot()->FindSemantic("things");
    for (const ObjectPtr& object : layer->Objects()) {
      if (object->label == label) return object;
    }
    return nullptr;
  }
  MapSession& session() { return *session_; }
  MemoryDisk& disk() { return disk_; }
  SessionOptions& options() { return options_; }

 private:
  MemoryDisk disk_;
  SessionOptions options_;
  std::unique_ptr<MapSession> session_;
};

inline void ExpectShowsTheSame(const FusedSite& a, const FusedSite& b) {
  EXPECT_EQ(ObjectsOf(*a.snapshot()), ObjectsOf(*b.snapshot()));
  EXPECT_EQ(ExploredCells(*a.snapshot()), ExploredCells(*b.snapshot()));
}

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_TESTING_FUSED_SITE_H_
