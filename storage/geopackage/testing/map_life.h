// The life of a map as a list of steps whose results are known beforehand, for tests that interrupt
// it.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TESTING_MAP_LIFE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TESTING_MAP_LIFE_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "storage/conformance/testing/recorded_map.h"
#include "storage/map_store.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {

// The steps that a map has been told. A step that was begun may be found in it whole or not at all;
// one that was acknowledged must be.
struct LifeProgress {
  Revision revision = 0;
  Revision oldest = 0;  // kept revision
  int num_marks = 0;
};

// Commits of objects, cells, frames and layers, alone and in groups; time marks; compactions; and
// closings, which move the log into the file. The commit that makes a revision is always the same,
// so that the content follows from the revision.
class MapLife {
 public:
  struct Step {
    enum class Kind { kWrite, kAddMark, kCompact, kReopen, kOpenReader, kCloseReader };
    Kind kind = Kind::kWrite;
    LifeProgress after;  // once the step is done
  };

  MapLife(testing::Rng& rng, const std::string& map_name, int num_commits);

  const std::vector<Step>& steps() const { return steps_; }

  // Carries out a step that is not kReopen.
  absl::Status Do(const Step& step, const LifeProgress& before, StoredMap& map);

  // Ends the reader that a step has opened.
  void CloseReader() { reader_ = nullptr; }

  // Expects that the map is as after some step between `least` and `most`, to the last change of
  // its history. Returns what was found.
  LifeProgress ExpectWhole(testing::Rng& rng, StoredMap& map, const LifeProgress& least,
                           const LifeProgress& most) const;

  // Expects that the map takes the next commit of the life.
  void ExpectGoesOn(StoredMap& map, const LifeProgress& now) const;
  // After the next commit; the same at the end of the life.
  LifeProgress Next(const LifeProgress& now) const;

 private:
  std::vector<Commit> CommitsOf(const LifeProgress& before, const LifeProgress& after) const;
  TimeMark MarkOf(int number) const;
  void ExpectSameNewest(const Snapshot& actual) const;
  void ExpectSamePast(testing::Rng& rng, HistoryReader& reader, const LifeProgress& now) const;
  void ExpectSameCommits(HistoryReader& reader, Revision after, Revision newest) const;
  void ExpectReceipts(testing::Rng& rng, StoredMap& map, Revision newest) const;

  std::vector<SnapshotPtr> snapshots_;  // by revision
  std::vector<Commit> commits_;         // that of revision r at r - 1
  std::vector<Step> steps_;
  std::unique_ptr<HistoryReader> reader_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TESTING_MAP_LIFE_H_
