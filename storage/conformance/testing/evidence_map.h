// A map whose log of evidence tests write.
#ifndef HYPERMAP_STORAGE_CONFORMANCE_TESTING_EVIDENCE_MAP_H_
#define HYPERMAP_STORAGE_CONFORMANCE_TESTING_EVIDENCE_MAP_H_

#include <cstdint>
#include <string>
#include <vector>

#include "storage/conformance/testing/edited_map.h"
#include "storage/fusion_log.h"

namespace hypermap::storage {

ObservationKey Key(int64_t nanos, const std::string& robot, int64_t sequence);

LoggedObservation Logged(const ObservationKey& key, const std::string& body);

// The sequences 0, `step`, ... `step` * (`count` - 1).
std::vector<int64_t> EveryNth(int64_t step, int64_t count);

// A map with the semantic layers "things" and "others".
class EvidenceMap {
 public:
  explicit EvidenceMap(EditedMap map);

  StoredMap& stored() { return *map_.stored; }
  FusionLog& log() { return map_.stored->fusion_log(); }
  const Snapshot& now() const { return *map_.snapshot; }
  EditedMap& edited() { return map_; }

  // Writes a commit with the change and the edits, or else the edits of an object in "others".
  void Write(FusionChange change, const EditBatch& batch = {});

  // Adds an observation of `robot` to "things" for each sequence, with stamps from `first_ns` on.
  void WriteObservations(const std::string& robot, const std::vector<int64_t>& sequences,
                         int64_t first_ns);

  // The bodies of the entries of "things".
  std::vector<std::string> Bodies(const LogKey& after, int max_entries = 100);

  // Removes all rows that are not needed.
  void Compact();

 private:
  EditedMap map_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_CONFORMANCE_TESTING_EVIDENCE_MAP_H_
