// Commits of a random map, which scenarios write one after another.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_HISTORY_H_
#define HYPERMAP_TESTS_ROBUSTNESS_HISTORY_H_

#include <string>
#include <vector>

#include "map/edits/edit.h"
#include "storage/map_store.h"
#include "tests/support/random_map.h"

namespace hypermap::robustness {

// The commits that make revisions 1, 2, ...
class History {
 public:
  History(testing::Rng& rng, const std::string& map, int num_objects, int num_commits);

  // Those after revision `from`, up to `to`.
  std::vector<storage::Commit> Commits(Revision from, Revision to) const;
  // Revision 0 is the empty map.
  const SnapshotPtr& at(Revision revision) const { return snapshots_[revision]; }
  std::vector<std::string> requests() const;

  // Adds the commit of a batch.
  void Add(const EditBatch& batch);
  Revision newest() const { return static_cast<Revision>(commits_.size()); }

 private:
  std::vector<SnapshotPtr> snapshots_;
  std::vector<storage::Commit> commits_;
};

storage::MapHeader HeaderOf(const std::string& map);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_HISTORY_H_
