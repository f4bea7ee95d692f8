// The versions of the objects that an editor has put.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_EDIT_LEDGER_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_EDIT_LEDGER_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "map/objects/semantic_object.h"
#include "map/snapshot.h"

namespace hypermap::bench {

// Differences between the objects of an editor and its acknowledged edits.
struct EditFaults {
  int64_t lost = 0;      // objects that are absent or older than an acknowledged edit
  int64_t repeated = 0;  // objects that are newer than every edit: one was carried out twice
};

// The versions of objects that nobody else edits. Not thread safe.
class EditLedger {
 public:
  // The objects were put in `revision`, and the server has acknowledged it.
  void NoteAcknowledged(const std::vector<ObjectId>& ids, Revision revision);
  // An edit of the object was sent, and may have been carried out or not. Does nothing for objects
  // that were never acknowledged (id 0).
  void NoteUncertain(ObjectId id);

  size_t size() const { return objects_.size(); }
  // The object with this index, by id. REQUIRES: index < size().
  ObjectId IdAt(size_t index) const;
  int64_t num_acknowledged() const { return num_acknowledged_; }
  // The newest acknowledged revision; 0 if there is none.
  Revision newest() const { return newest_; }
  // Compares with the versions that the objects have on the server.
  EditFaults Compare(const std::map<ObjectId, Revision>& versions) const;

 private:
  struct OwnObject {
    Revision version = 0;       // by the last acknowledged edit
    bool is_uncertain = false;  // may have a later version
  };

  std::map<ObjectId, OwnObject> objects_;
  int64_t num_acknowledged_ = 0;
  Revision newest_ = 0;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_EDIT_LEDGER_H_
