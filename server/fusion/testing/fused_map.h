// A map in memory with fused layers, without a session, for tests.
#ifndef HYPERMAP_SERVER_FUSION_TESTING_FUSED_MAP_H_
#define HYPERMAP_SERVER_FUSION_TESTING_FUSED_MAP_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "map/edits/apply.h"
#include "map/layers/semantic_layer.h"
#include "server/fusion/map_fusion.h"
#include "server/fusion/testing/memory_fusion_log.h"
#include "tests/support/random_map.h"
#include "wire/observation.h"

namespace hypermap::server {

inline EvidenceCodec TestCodec() {
  return {&wire::ObservationToBytes, &wire::ObservationFromBytes, &wire::ObjectToBytes,
          &wire::ObjectFromBytes,    &wire::CorrectionToBytes,    &wire::CorrectionFromBytes};
}

// Makes the named strategy with the parameters of a new layer, whatever a layer's settings say.
inline StrategyFactory Always(const char* strategy) {
  return [strategy](absl::string_view, absl::string_view) {
    return fusion::MakeStrategy(strategy, fusion::ParametersOfNewLayer(strategy, ""));
  };
}

// A map with the fused layers "things" and "other".
class FusedMap {
 public:
  explicit FusedMap(StrategyFactory make_strategy = &fusion::MakeStrategy) {
    options_.codec = TestCodec();
    options_.make_strategy = std::move(make_strategy);
    EditBatch layers;
    for (const char* name : {"things", "other"}) {
      LayerSpec spec;
      spec.name = name;
      layers.edits.push_back(CreateLayer{spec});
    }
    snapshot_ = std::make_shared<const Snapshot>(hypermap::testing::MakeSnapshot("site", layers));
    Restart();
    for (const char* name : {"things", "other"}) {
      EXPECT_TRUE(Run(StartFusion{name, {}}).ok());
    }
  }

  // Drops what is in memory.
  void Restart() {
    auto fusion = MapFusion::Open(&log_, &options_, Limits());
    ASSERT_TRUE(fusion.ok()) << fusion.status();
    fusion_ = *std::move(fusion);
  }

  // Applies a batch with the reaction to it. Returns the ids of its objects.
  absl::StatusOr<std::vector<ObjectId>> Edit(const EditBatch& batch) {
    HYPERMAP_ASSIGN_OR_RETURN(const AppliedBatch applied, Apply(*snapshot_, batch));
    HYPERMAP_ASSIGN_OR_RETURN(FusionReaction reaction, React(batch, applied));
    return Commit(batch, reaction);
  }
  absl::StatusOr<FusionReaction> React(const EditBatch& batch, const AppliedBatch& applied) {
    return fusion_->React(*snapshot_, batch, applied);
  }
  absl::StatusOr<std::vector<ObjectId>> Commit(EditBatch batch, const FusionReaction& reaction) {
    const size_t own = batch.edits.size();
    batch.edits.insert(batch.edits.end(), reaction.edits.begin(), reaction.edits.end());
    std::vector<ObjectId> ids;
    if (!batch.edits.empty()) {
      HYPERMAP_ASSIGN_OR_RETURN(AppliedBatch applied, ApplyExtended(*snapshot_, batch));
      snapshot_ = std::move(applied.snapshot);
      ids = std::move(applied.object_ids);
    }
    const absl::Span<const ObjectId> of_reaction = absl::MakeConstSpan(ids).subspan(own);
    for (const storage::FusionChange& change : fusion_->Finish(reaction, of_reaction)) {
      log_.Apply(change);
    }
    fusion_->Written();
    ids.resize(own);
    return ids;
  }

  // Carries out a command. Returns the edits of the reaction.
  absl::StatusOr<std::vector<hypermap::Edit>> Run(const FusionCommand& command) {
    HYPERMAP_ASSIGN_OR_RETURN(const FusionReaction reaction, fusion_->Run(*snapshot_, command));
    HYPERMAP_RETURN_IF_ERROR(Commit({}, reaction).status());
    return reaction.edits;
  }

  // Admits observations to "things", and commits the result. Returns the outcome of the first.
  absl::StatusOr<ObservationOutcome> Observe(const Observation& observation) {
    return Observe(std::vector<Observation>{observation});
  }
  absl::StatusOr<ObservationOutcome> Observe(const std::vector<Observation>& observations) {
    absl::Time now;
    for (const Observation& observation : observations) now = std::max(now, observation.stamp);
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<ObservationVerdict> verdicts,
                              fusion_->Admit(*snapshot_, "things", observations, now));
    HYPERMAP_ASSIGN_OR_RETURN(const FusionReaction reaction,
                              fusion_->FoldAdmitted(*snapshot_, "things"));
    HYPERMAP_RETURN_IF_ERROR(Commit({}, reaction).status());
    return verdicts.front().outcome;
  }

  // The objects of "things", by id.
  std::vector<SemanticObject> Objects() const {
    std::vector<SemanticObject> objects;
    for (const ObjectPtr& object : snapshot_->FindSemantic("things")->Objects()) {
      objects.push_back(*object);
    }
    return objects;
  }
  // The log of "things".
  std::vector<storage::LogEntry> Log() {
    return *log_.Read("things", storage::BeforeAll(), std::numeric_limits<int>::max());
  }
  const Snapshot& snapshot() const { return *snapshot_; }
  MapFusion& fusion() { return *fusion_; }
  FusionOptions& options() { return options_; }

 private:
  MemoryFusionLog log_;
  FusionOptions options_;
  SnapshotPtr snapshot_;
  std::unique_ptr<MapFusion> fusion_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_TESTING_FUSED_MAP_H_
