// Compares what a store tells of the past of a map with recorded snapshots and changes.
#ifndef HYPERMAP_STORAGE_CONFORMANCE_TESTING_RECORDED_HISTORY_H_
#define HYPERMAP_STORAGE_CONFORMANCE_TESTING_RECORDED_HISTORY_H_

#include "storage/conformance/testing/recorded_map.h"
#include "storage/history.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {

// Expects the objects and cells of `expected`, also in random parts of each layer.
void ExpectContentAsRecorded(hypermap::testing::Rng& rng, PastMap& past, const Snapshot& expected);

// Expects one revision to be as it was.
void ExpectPastIsAsRecorded(hypermap::testing::Rng& rng, HistoryReader& reader,
                            const RecordedMap& map, Revision revision);

// Expects all revisions from `oldest` on and the commits after it to be as they were, and nothing
// else to be kept.
void ExpectAllAsRecorded(hypermap::testing::Rng& rng, HistoryReader& reader, const RecordedMap& map,
                         Revision oldest);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_CONFORMANCE_TESTING_RECORDED_HISTORY_H_
