// A stored map, and a plain model of all that its store must tell of it.
#ifndef HYPERMAP_STORAGE_CONFORMANCE_TESTING_MODEL_MAP_H_
#define HYPERMAP_STORAGE_CONFORMANCE_TESTING_MODEL_MAP_H_

#include <map>
#include <string>
#include <vector>

#include "storage/conformance/testing/evidence_model.h"
#include "storage/conformance/testing/recorded_map.h"
#include "storage/map_store.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {

// Each step changes the map and the model alike.
class ModelMap {
 public:
  // Creates the map. Fails the test if that fails.
  ModelMap(MapStore& store, const MapHeader& header);

  // Writes a group of commits, with requests and evidence.
  void WriteGroup(hypermap::testing::Rng& rng);
  // Writes several revisions as one commit and forgets the past, as a replica does.
  void WriteAsReplica(hypermap::testing::Rng& rng);
  void CompactOnce(hypermap::testing::Rng& rng);
  void CompactAll(hypermap::testing::Rng& rng);
  void KeepCheckpoint(hypermap::testing::Rng& rng);
  void MoveBase(hypermap::testing::Rng& rng);
  void AddMark(hypermap::testing::Rng& rng);

  void Close() { history_.Close(); }
  void Open(MapStore& store) { history_.Open(store); }

  void ExpectSame(hypermap::testing::Rng& rng);

 private:
  struct TimedReceipt {
    Receipt receipt;
    absl::Time time;
  };

  Commit RandomCommit(hypermap::testing::Rng& rng, const Snapshot& before);
  // Adds changes of the evidence to a commit, and carries them out.
  void AddEvidence(hypermap::testing::Rng& rng, Commit* commit);
  Revision RandomKept(hypermap::testing::Rng& rng) const;
  // A compaction up to `oldest` and `receipts_before` has left nothing to remove.
  void SettleCompaction(absl::Time receipts_before);

  void ExpectSameHeader();
  void ExpectSameReceipts();
  void ExpectSameRevisions(hypermap::testing::Rng& rng, HistoryReader& reader) const;
  void ExpectSameTimes(hypermap::testing::Rng& rng, HistoryReader& reader) const;
  void ExpectSameEvidence(hypermap::testing::Rng& rng);

  MapHeader header_;
  RecordedMap history_;
  Revision oldest_ = 0;
  std::map<std::string, EvidenceModel> evidence_;  // by layer
  std::map<std::string, TimedReceipt> receipts_;   // by request
  // Receipts from before this time may be forgotten, but need not be yet.
  absl::Time receipts_may_end_ = absl::InfinitePast();
  std::vector<TimeMark> marks_;
  int num_marks_ = 0;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_CONFORMANCE_TESTING_MODEL_MAP_H_
