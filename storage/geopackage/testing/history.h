// A map together with all its past states, and random edits, for tests of the history.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TESTING_HISTORY_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TESTING_HISTORY_H_

#include <memory>
#include <vector>

#include "storage/geopackage/testing/map.h"
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

  // Writes the batches as one group.
  void Write(const std::vector<EditBatch>& batches);

  // Compacts until nothing is left to remove.
  void Compact(Revision oldest, int max_rows);

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

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TESTING_HISTORY_H_
