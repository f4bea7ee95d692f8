// A map with all that it ever was, and random lives of maps, for tests of the history.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_TESTING_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_TESTING_H_

#include <memory>
#include <vector>

#include "storage/geopackage/map_testing.h"
#include "storage/history.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {

bool SameTile(const TilePtr& a, const TilePtr& b);
// Also of one version.
bool SameObject(const ObjectPtr& a, const ObjectPtr& b);
bool SameChange(const Change& a, const Change& b);

// A map and all that it ever was.
class RecordedMap {
 public:
  explicit RecordedMap(EditedMap map) : map_(std::move(map)) { snapshots_ = {map_.snapshot}; }

  // Opens the map again from its store, as a server that starts again does.
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

// Something of everything, sometimes with layers that come and go.
EditBatch RandomBatch(hypermap::testing::Rng& rng, const Snapshot& now);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_TESTING_H_
