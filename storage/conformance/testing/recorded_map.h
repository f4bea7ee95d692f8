// A map together with all its past states, and random edits, for tests of the history.
#ifndef HYPERMAP_STORAGE_CONFORMANCE_TESTING_RECORDED_MAP_H_
#define HYPERMAP_STORAGE_CONFORMANCE_TESTING_RECORDED_MAP_H_

#include <memory>
#include <vector>

#include "storage/conformance/testing/edited_map.h"
#include "storage/history.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {

bool SameTile(const TilePtr& a, const TilePtr& b);
// Returns whether the objects are equal and have the same version.
bool SameObject(const ObjectPtr& a, const ObjectPtr& b);
bool SameChange(const Change& a, const Change& b);

// A map and all its past states.
class RecordedMap {
 public:
  explicit RecordedMap(EditedMap map) : map_(std::move(map)) { snapshots_ = {map_.snapshot}; }

  // Closes the map and opens it from its store, as a restarted server does.
  void Reopen(MapStore& store);
  // The parts of Reopen. Open expects that the map is as it was.
  void Close() { map_.stored.reset(); }
  void Open(MapStore& store);

  // Writes the batches as one group of commits.
  void Write(const std::vector<EditBatch>& batches);
  // Writes one group. REQUIRES: the commits follow the newest one.
  void WriteCommits(const std::vector<Commit>& commits);
  // Writes the batches as one commit that skips all revisions but the last, as a replica does. What
  // the history tells of the skipped revisions, and of the commit itself, is not promised. Returns
  // the changes of the commit.
  std::vector<Change> WriteSquashed(const std::vector<EditBatch>& batches);

  // Compacts until nothing is left to remove.
  void Compact(Revision oldest, int max_rows, absl::Time receipts_before = absl::InfinitePast());

  std::unique_ptr<HistoryReader> Reader() const;

  const Snapshot& at(Revision revision) const { return *snapshots_.at(revision); }
  const Commit& commit(Revision revision) const { return commits_.at(revision - 1); }
  Revision newest() const { return map_.snapshot->revision; }
  const Snapshot& now() const { return *map_.snapshot; }
  StoredMap& stored() { return *map_.stored; }

 private:
  EditedMap map_;
  std::vector<SnapshotPtr> snapshots_;
  std::vector<Commit> commits_;
};

// Random edits of every kind; sometimes layers are created and deleted.
EditBatch RandomBatch(hypermap::testing::Rng& rng, const Snapshot& now);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_CONFORMANCE_TESTING_RECORDED_MAP_H_
