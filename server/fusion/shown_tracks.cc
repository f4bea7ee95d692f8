#include "server/fusion/shown_tracks.h"

#include <algorithm>
#include <iterator>
#include <optional>

#include "absl/strings/str_cat.h"
#include "map/layers/semantic_layer.h"

namespace hypermap::server {
namespace {

ObjectPtr WithId(const SemanticObject& object, ObjectId id) {
  auto copy = std::make_shared<SemanticObject>(object);
  copy->id = id;
  return copy;
}

// The track that an operator's object gets if it has none. Tracks of detections have keys with two
// slashes.
fusion::TrackKey FirstTrackOf(ObjectId id) { return absl::StrCat("operator/", id); }

// Finds fused objects by label and shape, numbered as in `fused`.
ThingIndex ThingsOf(const std::vector<fusion::FusedObject>& fused) {
  ThingIndex things;
  for (size_t i = 0; i < fused.size(); ++i) things.Add(fused[i].object, i);
  return things;
}

// Binary search: strategies return objects sorted by track.
bool Holds(const std::vector<fusion::FusedObject>& fused, const fusion::TrackKey& track) {
  const auto it =
      std::lower_bound(fused.begin(), fused.end(), track,
                       [](const auto& object, const auto& key) { return object.track < key; });
  return it != fused.end() && it->track == track;
}

}  // namespace

void ShownTracks::Load(const std::vector<storage::TrackId>& stored, const Snapshot& snapshot,
                       const std::vector<fusion::FusedObject>& fused) {
  const SemanticLayer* layer = snapshot.FindSemantic(layer_);
  for (const auto& [track, id] : stored) {
    if (id == 0) continue;
    ids_[track] = id;
    tracks_by_id_.emplace(id, track);
    const ObjectPtr object = layer == nullptr ? nullptr : layer->Find(id);
    if (object) shown_[track] = {id, WithId(*object, 0)};
  }
  // The strategy shows at most one of the tracks that have shown an object. If it shows none, the
  // next Show removes the object.
  std::set<ObjectId> of_fused;
  for (const fusion::FusedObject& object : fused) {
    const auto shown = shown_.find(object.track);
    if (shown != shown_.end()) of_fused.insert(shown->second.id);
  }
  for (auto it = shown_.begin(); it != shown_.end();) {
    const bool is_former = of_fused.count(it->second.id) > 0 && !Holds(fused, it->first);
    it = is_former ? shown_.erase(it) : std::next(it);
  }
}

std::vector<fusion::TrackKey> ShownTracks::TracksOf(ObjectId id) const {
  std::vector<fusion::TrackKey> tracks;
  for (auto it = tracks_by_id_.lower_bound({id, ""}); it != tracks_by_id_.end() && it->first == id;
       ++it) {
    tracks.push_back(it->second);
  }
  return tracks;
}

fusion::TrackKey ShownTracks::TrackOf(ObjectId id) const {
  const std::vector<fusion::TrackKey> tracks = TracksOf(id);
  for (const fusion::TrackKey& track : tracks) {
    const auto shown = shown_.find(track);
    if (shown != shown_.end() && shown->second.id == id) return track;
  }
  if (!tracks.empty()) return tracks.front();
  const fusion::TrackKey first = FirstTrackOf(id);
  fusion::TrackKey own = first;
  for (int i = 2; IsTrackOfAnother(own, id); ++i) own = absl::StrCat(first, "#", i);
  return own;
}

bool ShownTracks::HasLostItsTrack(ObjectId id) const {
  return TracksOf(id).empty() && IsTrackOfAnother(FirstTrackOf(id), id);
}

bool ShownTracks::IsTrackOfAnother(const fusion::TrackKey& track, ObjectId id) const {
  const auto known = ids_.find(track);
  return known != ids_.end() && known->second != 0 && known->second != id;
}

void ShownTracks::SetId(const fusion::TrackKey& track, ObjectId id) {
  ObjectId& own = ids_[track];
  tracks_by_id_.erase({own, track});
  tracks_by_id_.emplace(id, track);
  own = id;
  changed_.insert(track);
}

void ShownTracks::Tell(const std::shared_ptr<const fusion::OperatorFact>& fact, ObjectId id) {
  was_told_ = true;
  const fusion::TrackKey& track = fact->track;
  const auto known = ids_.find(track);
  if (known == ids_.end() || known->second != id) SetId(track, id);
  if (fact->kind == fusion::OperatorFact::Kind::kPin) {
    const ObjectPtr told(fact, &fact->object);  // Shares the memory of the fact.
    shown_[track] = {id, told};
    pinned_[track] = told;
  } else {
    shown_.erase(track);
    pinned_.erase(track);
  }
}

void ShownTracks::AdoptPinned(const std::vector<fusion::FusedObject>& fused) {
  std::optional<ThingIndex> things;
  for (const auto& [track, object] : std::exchange(pinned_, {})) {
    const auto own = shown_.find(track);
    if (own == shown_.end() || Holds(fused, track)) continue;
    if (!things) things = ThingsOf(fused);
    const std::optional<size_t> taken_over = things->Find(*object);
    if (!taken_over) {
      // The strategy shows no such object. The operator's stays on the map, without a track, so
      // that fusion never changes it.
      for (const fusion::TrackKey& former : TracksOf(own->second.id)) SetId(former, 0);
      shown_.erase(own);
      continue;
    }
    // The strategy gave the pin to another track. That track now shows the operator's object, under
    // the operator's id; its former object is left to a track that is gone, so that Show removes
    // it.
    const fusion::TrackKey& by = fused[*taken_over].track;
    Shown& other = shown_[by];
    std::swap(other, own->second);
    SetId(by, other.id);
    if (own->second.id == 0) shown_.erase(own);
  }
}

void ShownTracks::Put(const fusion::FusedObject& fused, Shown* shown, std::vector<Edit>* edits) {
  // A track that comes back gets the id that it had, for which the edit is allowed to revive.
  if (shown->id == 0) {
    const auto known = ids_.find(fused.track);
    if (known != ids_.end()) shown->id = known->second;
  }
  if (shown->id == 0) new_objects_[edits->size()] = fused.track;
  shown->object = fused.object;
  PutObject put{layer_, *fused.object, "", /*revive=*/true};
  put.object.id = shown->id;
  edits->push_back(std::move(put));
}

void ShownTracks::Show(const std::vector<fusion::FusedObject>& fused, const Snapshot& snapshot,
                       std::vector<Edit>* edits) {
  new_objects_.clear();
  was_told_ = false;
  AdoptPinned(fused);
  // A merge of two lists that are sorted by track. New tracks are shown at the end, because only
  // then all objects are known that they can inherit an id from.
  std::vector<Shown> gone;
  std::vector<const fusion::FusedObject*> come;
  auto shown = shown_.begin();
  const auto drop_until = [&](const fusion::TrackKey* track) {
    while (shown != shown_.end() && (track == nullptr || shown->first < *track)) {
      gone.push_back(std::move(shown->second));
      shown = shown_.erase(shown);
    }
  };
  for (const fusion::FusedObject& object : fused) {
    drop_until(&object.track);
    if (shown == shown_.end() || shown->first != object.track) {
      if (Validate(*object.object).ok()) come.push_back(&object);
      continue;
    }
    Update(object, &shown->second, edits);
    ++shown;
  }
  drop_until(nullptr);
  ShowNew(come, std::move(gone), snapshot, edits);
}

void ShownTracks::ShowChanges(const std::vector<fusion::FusedObject>& changed,
                              const Snapshot& snapshot, std::vector<Edit>* edits) {
  new_objects_.clear();
  std::vector<Shown> gone;
  std::vector<const fusion::FusedObject*> come;
  for (const fusion::FusedObject& object : changed) {
    const auto shown = shown_.find(object.track);
    if (shown == shown_.end()) {
      if (object.object && Validate(*object.object).ok()) come.push_back(&object);
    } else if (object.object) {
      Update(object, &shown->second, edits);
    } else {
      gone.push_back(std::move(shown->second));
      shown_.erase(shown);
    }
  }
  ShowNew(come, std::move(gone), snapshot, edits);
}

void ShownTracks::ShowNew(const std::vector<const fusion::FusedObject*>& come,
                          std::vector<Shown> gone, const Snapshot& snapshot,
                          std::vector<Edit>* edits) {
  ThingIndex gone_things;
  for (size_t i = 0; i < gone.size(); ++i) {
    if (gone[i].id != 0) gone_things.Add(gone[i].object, i);
  }
  for (const fusion::FusedObject* object : come) {
    Shown& entry = shown_[object->track];
    if (ids_.count(object->track) == 0) Inherit(*object, &gone_things, &gone, &entry);
    Update(*object, &entry, edits);
  }
  Remove(gone, snapshot, edits);
}

void ShownTracks::Update(const fusion::FusedObject& fused, Shown* shown, std::vector<Edit>* edits) {
  // States share unchanged objects, so that most are equal by pointer.
  if (shown->object == fused.object) return;
  if (shown->object && *shown->object == *fused.object) {
    shown->object = fused.object;
    return;
  }
  if (Validate(*fused.object).ok()) Put(fused, shown, edits);
}

void ShownTracks::Inherit(const fusion::FusedObject& fused, ThingIndex* gone_things,
                          std::vector<Shown>* gone, Shown* shown) {
  const std::optional<size_t> same = gone_things->Take(*fused.object);
  if (!same) return;
  *shown = std::exchange((*gone)[*same], Shown());
  SetId(fused.track, shown->id);
}

void ShownTracks::Remove(const std::vector<Shown>& gone, const Snapshot& snapshot,
                         std::vector<Edit>* edits) {
  if (gone.empty()) return;
  // Another track may show the object by now, and an operator may have deleted it.
  std::set<ObjectId> kept = {0};
  const SemanticLayer* layer = snapshot.FindSemantic(layer_);
  for (const Shown& object : gone) {
    if (kept.insert(object.id).second && !IsShown(object.id) && layer != nullptr &&
        layer->Find(object.id)) {
      edits->push_back(DeleteObject{layer_, object.id});
    }
  }
}

bool ShownTracks::IsShown(ObjectId id) const {
  const std::vector<fusion::TrackKey> tracks = TracksOf(id);
  return std::any_of(tracks.begin(), tracks.end(), [&](const fusion::TrackKey& track) {
    const auto shown = shown_.find(track);
    return shown != shown_.end() && shown->second.id == id;
  });
}

void ShownTracks::Assign(absl::Span<const ObjectId> object_ids) {
  for (const auto& [edit, track] : new_objects_) {
    shown_[track].id = object_ids[edit];
    SetId(track, object_ids[edit]);
  }
  new_objects_.clear();
}

std::vector<storage::TrackId> ShownTracks::TakeChanges() {
  std::vector<storage::TrackId> changes;
  changes.reserve(changed_.size());
  for (const fusion::TrackKey& track : changed_) changes.emplace_back(track, ids_[track]);
  changed_.clear();
  return changes;
}

}  // namespace hypermap::server
