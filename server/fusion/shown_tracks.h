// The relation between the objects of a fused layer and the tracks of its fold that they show.
#ifndef HYPERMAP_SERVER_FUSION_SHOWN_TRACKS_H_
#define HYPERMAP_SERVER_FUSION_SHOWN_TRACKS_H_

#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/types/span.h"
#include "map/edits/edit.h"
#include "map/fusion/strategy.h"
#include "map/snapshot.h"
#include "server/fusion/thing_index.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

// Keeps the ids of objects from one state of the fold to the next. What the layer shows is changed
// in these steps:
//   1. Tell, for each fact that an operator stated.
//   2. Show, with what the strategy shows of the new state, returns the edits of the layer.
//   3. Assign, with the ids that new objects got.
// Lists of objects of the strategy (`fused`) are sorted by track. A value. Not thread safe.
class ShownTracks {
 public:
  explicit ShownTracks(std::string layer) : layer_(std::move(layer)) {}

  // Begins with the tracks that are stored, and with the objects that `snapshot` has; it shows
  // `fused`.
  void Load(const std::vector<storage::TrackId>& stored, const Snapshot& snapshot,
            const std::vector<fusion::FusedObject>& fused);

  // The tracks that the object shows or has shown, sorted; empty if fusion knows nothing of it.
  std::vector<fusion::TrackKey> TracksOf(ObjectId id) const;
  // The object's track; for an object without one, a key for a track of its own.
  fusion::TrackKey TrackOf(ObjectId id) const;
  // Returns whether the object has lost its track to another object, so that fusion knows nothing
  // of it.
  bool HasLostItsTrack(ObjectId id) const;

  // An operator put or removed the object; the fact is about TrackOf the object.
  void Tell(const std::shared_ptr<const fusion::OperatorFact>& fact, ObjectId id);
  // Adds the edits that make the layer show `fused`. `snapshot` shows what the edits of the last
  // Show and the facts since made of it.
  void Show(const std::vector<fusion::FusedObject>& fused, const Snapshot& snapshot,
            std::vector<Edit>* edits);
  // The same, if only the objects of these tracks may differ from those of the last Show; null for
  // one that is not shown any more. Costs nothing for the others. REQUIRES: !was_told().
  void ShowChanges(const std::vector<fusion::FusedObject>& changed, const Snapshot& snapshot,
                   std::vector<Edit>* edits);
  // Whether Tell was called since the last Show.
  bool was_told() const { return was_told_; }
  // `object_ids` has an id for each of the edits (AppliedBatch::object_ids).
  void Assign(absl::Span<const ObjectId> object_ids);

  // The tracks whose ids have changed since the last call.
  std::vector<storage::TrackId> TakeChanges();

 private:
  // The object that shows a track.
  struct Shown {
    ObjectId id = 0;   // 0: not on the map yet
    ObjectPtr object;  // with id 0, so that it can be compared with a FusedObject
  };

  // Returns whether the track shows or has shown another object than this one.
  bool IsTrackOfAnother(const fusion::TrackKey& track, ObjectId id) const;
  void SetId(const fusion::TrackKey& track, ObjectId id);
  // Assigns each object that an operator put to the track that the strategy made of it.
  void AdoptPinned(const std::vector<fusion::FusedObject>& fused);
  // Ends Show: shows new objects, and removes those of `gone` that no other track shows.
  void ShowNew(const std::vector<const fusion::FusedObject*>& come, std::vector<Shown> gone,
               const Snapshot& snapshot, std::vector<Edit>* edits);
  // Returns whether a track shows the object.
  bool IsShown(ObjectId id) const;
  // Adds an edit if `shown` differs from the fused object.
  void Update(const fusion::FusedObject& fused, Shown* shown, std::vector<Edit>* edits);
  void Put(const fusion::FusedObject& fused, Shown* shown, std::vector<Edit>* edits);
  // Lets a new track keep the id of an equal object of a track that is gone: late evidence can give
  // a thing another founder, and so another track key. `gone_things` has the objects of `gone`.
  void Inherit(const fusion::FusedObject& fused, ThingIndex* gone_things, std::vector<Shown>* gone,
               Shown* shown);
  void Remove(const std::vector<Shown>& gone, const Snapshot& snapshot, std::vector<Edit>* edits);

  std::string layer_;
  std::map<fusion::TrackKey, Shown> shown_;
  // The ids of all tracks. A track that is not shown any more keeps its id, so that the object gets
  // it again if the track comes back.
  std::unordered_map<fusion::TrackKey, ObjectId> ids_;
  // The same pairs, sorted by id.
  std::set<std::pair<ObjectId, fusion::TrackKey>> tracks_by_id_;
  // The objects that an operator put since the last Show.
  std::map<fusion::TrackKey, ObjectPtr> pinned_;
  bool was_told_ = false;
  // Result of the last Show: the track of each edit that puts a new object, by the edit's index.
  std::map<size_t, fusion::TrackKey> new_objects_;
  std::set<fusion::TrackKey> changed_;  // since the last TakeChanges
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_SHOWN_TRACKS_H_
