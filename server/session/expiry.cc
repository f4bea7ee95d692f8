#include "server/session/expiry.h"

#include <limits>
#include <variant>

#include "map/layers/semantic_layer.h"

namespace hypermap::server {

ExpirySchedule::ExpirySchedule(const Snapshot& snapshot, const MapTime* time) : time_(time) {
  for (const auto& [name, layer] : snapshot.layers) {
    const auto* semantic = AsSemantic(layer.get());
    if (semantic == nullptr) continue;
    for (const ObjectPtr& object : semantic->Objects()) {
      if (object->expires_at) Set(name, *object);
    }
  }
}

void ExpirySchedule::Set(const std::string& layer, const SemanticObject& object) {
  Remove(layer, object.id);
  if (!object.expires_at) return;
  const Key key(layer, object.id);
  const absl::Duration end = time_->EndOf(object);
  ends_.emplace(key, end);
  by_end_.emplace(end, key);
}

void ExpirySchedule::Remove(const std::string& layer, ObjectId id) {
  const auto it = ends_.find(Key(layer, id));
  if (it == ends_.end()) return;
  by_end_.erase({it->second, it->first});
  ends_.erase(it);
}

void ExpirySchedule::RemoveLayer(const std::string& layer) {
  auto it = ends_.lower_bound(Key(layer, std::numeric_limits<ObjectId>::min()));
  while (it != ends_.end() && it->first.first == layer) {
    by_end_.erase({it->second, it->first});
    it = ends_.erase(it);
  }
}

void ExpirySchedule::Update(const std::vector<Change>& changes) {
  for (const Change& change : changes) {
    if (const auto* put = std::get_if<ObjectPut>(&change)) {
      Set(put->layer, *put->after);
    } else if (const auto* removed = std::get_if<ObjectRemoved>(&change)) {
      Remove(removed->layer, removed->before->id);
    } else if (const auto* deleted = std::get_if<LayerDeleted>(&change)) {
      RemoveLayer(deleted->spec.name);
    }
  }
}

absl::Duration ExpirySchedule::next() const {
  return by_end_.empty() ? absl::InfiniteDuration() : by_end_.begin()->first;
}

EditBatch ExpirySchedule::Due(absl::Duration lived, size_t max_edits) const {
  EditBatch batch;
  for (const auto& [end, key] : by_end_) {
    if (end > lived || batch.edits.size() >= max_edits) break;
    batch.edits.push_back(DeleteObject{key.first, key.second, {}});
  }
  return batch;
}

}  // namespace hypermap::server
