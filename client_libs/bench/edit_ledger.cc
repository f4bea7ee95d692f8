#include "client_libs/bench/edit_ledger.h"

#include <algorithm>
#include <iterator>

namespace hypermap::bench {

void EditLedger::NoteAcknowledged(const std::vector<ObjectId>& ids, Revision revision) {
  ++num_acknowledged_;
  newest_ = std::max(newest_, revision);
  for (const ObjectId id : ids) objects_[id].version = revision;
}

void EditLedger::NoteUncertain(ObjectId id) {
  const auto object = objects_.find(id);
  if (object != objects_.end()) object->second.is_uncertain = true;
}

ObjectId EditLedger::IdAt(size_t index) const {
  return std::next(objects_.begin(), static_cast<std::ptrdiff_t>(index))->first;
}

EditFaults EditLedger::Compare(const std::map<ObjectId, Revision>& versions) const {
  EditFaults faults;
  for (const auto& [id, object] : objects_) {
    const auto found = versions.find(id);
    if (found == versions.end() || found->second < object.version) {
      ++faults.lost;
    } else if (found->second > object.version && !object.is_uncertain) {
      ++faults.repeated;
    }
  }
  return faults;
}

}  // namespace hypermap::bench
