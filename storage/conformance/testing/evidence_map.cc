#include "storage/conformance/testing/evidence_map.h"

#include <utility>

#include "gtest/gtest.h"

namespace hypermap::storage {

ObservationKey Key(int64_t nanos, const std::string& robot, int64_t sequence) {
  return {absl::FromUnixNanos(nanos), robot, sequence};
}

LoggedObservation Logged(const ObservationKey& key, const std::string& body) {
  return {key, 0xfedcba9876543210, absl::FromUnixNanos(99), body};
}

std::vector<int64_t> EveryNth(int64_t step, int64_t count) {
  std::vector<int64_t> sequences;
  for (int64_t i = 0; i < count; ++i) sequences.push_back(step * i);
  return sequences;
}

EvidenceMap::EvidenceMap(EditedMap map) : map_(std::move(map)) {
  map_.Edit({{CreateLayer{SemanticSpec("things")}, CreateLayer{SemanticSpec("others")}}});
}

void EvidenceMap::Write(FusionChange change, const EditBatch& batch) {
  Commit commit = batch.edits.empty()
                      ? MakeCommit(*map_.snapshot, {{PutObject{"others", UnitSquare("cup"), ""}}})
                      : MakeCommit(*map_.snapshot, batch);
  if (!change.layer.empty()) commit.fusion.push_back(std::move(change));
  const absl::Status status = map_.stored->Write({commit});
  ASSERT_TRUE(status.ok()) << status;
  map_.snapshot = commit.applied.snapshot;
}

void EvidenceMap::WriteObservations(const std::string& robot, const std::vector<int64_t>& sequences,
                                    int64_t first_ns) {
  FusionChange change{.layer = "things", .settings = FusionSettings{"evidence", "{}", ""}};
  for (const int64_t sequence : sequences) {
    change.observations.push_back(Logged(Key(first_ns++, robot, sequence), "body"));
  }
  Write(std::move(change));
}

std::vector<std::string> EvidenceMap::Bodies(const LogKey& after, int max_entries) {
  const auto entries = log().Read("things", after, max_entries);
  EXPECT_TRUE(entries.ok()) << entries.status();
  std::vector<std::string> bodies;
  if (!entries.ok()) return bodies;
  for (const LogEntry& entry : *entries) bodies.push_back(entry.body);
  return bodies;
}

void EvidenceMap::Compact() {
  absl::StatusOr<bool> more = true;
  while (more.ok() && *more) more = map_.stored->Compact(0, absl::InfinitePast(), 100);
  EXPECT_TRUE(more.ok()) << more.status();
}

}  // namespace hypermap::storage
