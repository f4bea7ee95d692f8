#include "server/fusion/fused_layer.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "map/layers/semantic_layer.h"
#include "server/fusion/explored_area.h"

namespace hypermap::server {
namespace {

// Number of checkpoints in memory. When there are more, every second one of the older half is
// dropped: the older a checkpoint, the less likely an observation is so late that it is needed.
constexpr size_t kMaxCheckpoints = 128;

// FNV-1a, 64 bits (Fowler, Noll, Vo). Hashes are stored, so that this function can't change.
uint64_t HashOf(absl::string_view bytes) {
  uint64_t hash = 0xcbf29ce484222325;
  for (const char c : bytes) hash = (hash ^ static_cast<uint8_t>(c)) * 0x100000001b3;
  return hash;
}

ObjectPtr WithId(const SemanticObject& object, ObjectId id) {
  auto copy = std::make_shared<SemanticObject>(object);
  copy->id = id;
  return copy;
}

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

void Earlier(const storage::LogKey& key, std::optional<storage::LogKey>* first) {
  if (!*first || key < **first) *first = key;
}

}  // namespace

FusedLayer::FusedLayer(std::string layer, storage::FusionSettings settings,
                       std::unique_ptr<fusion::Strategy> strategy, EvidenceLog log,
                       storage::FusionLog* stored, const FusionOptions* options)
    : layer_(std::move(layer)),
      settings_(std::move(settings)),
      strategy_(std::move(strategy)),
      log_(std::move(log)),
      stored_(stored),
      options_(options),
      tip_{storage::BeforeAll(), strategy_->Initial()} {}

absl::StatusOr<std::unique_ptr<FusedLayer>> FusedLayer::Begin(
    const std::string& layer, const storage::FusionSettings& settings, storage::FusionLog* stored,
    const FusionOptions* options) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<fusion::Strategy> strategy,
                            options->make_strategy(settings.strategy, settings.parameters));
  HYPERMAP_ASSIGN_OR_RETURN(EvidenceLog log, EvidenceLog::Open(layer, stored, &options->codec));
  std::unique_ptr<FusedLayer> fused(
      new FusedLayer(layer, settings, std::move(strategy), std::move(log), stored, options));
  fused->settings_changed_ = true;
  return fused;
}

absl::StatusOr<std::unique_ptr<FusedLayer>> FusedLayer::Open(
    const std::string& layer, const storage::FusionSettings& settings, storage::FusionLog* stored,
    const FusionOptions* options, const Snapshot& snapshot) {
  absl::StatusOr<std::unique_ptr<FusedLayer>> fused = Begin(layer, settings, stored, options);
  if (!fused.ok()) return fused;
  (*fused)->settings_changed_ = false;
  HYPERMAP_RETURN_IF_ERROR((*fused)->LoadShown(snapshot));
  HYPERMAP_ASSIGN_OR_RETURN(
      Checkpoint checkpoint,
      (*fused)->CheckpointBefore(
          {{absl::FromUnixNanos(std::numeric_limits<int64_t>::max()), "", 0}, 0}));
  HYPERMAP_RETURN_IF_ERROR((*fused)->FoldOn(std::move(checkpoint)));
  (*fused)->new_entries_ = (*fused)->entries_folded_;
  (*fused)->CountBytes();
  return fused;
}

absl::Status FusedLayer::LoadShown(const Snapshot& snapshot) {
  const SemanticLayer* layer = snapshot.FindSemantic(layer_);
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<storage::TrackId> tracks, stored_->Tracks(layer_));
  for (const auto& [track, id] : tracks) {
    if (id == 0) continue;
    ids_[track] = id;
    tracks_by_id_.emplace(id, track);
    const ObjectPtr object = layer == nullptr ? nullptr : layer->Find(id);
    if (object) shown_[track] = {id, WithId(*object, 0)};
  }
  return absl::OkStatus();
}

std::vector<fusion::TrackKey> FusedLayer::TracksOf(ObjectId id) const {
  std::vector<fusion::TrackKey> tracks;
  for (auto it = tracks_by_id_.lower_bound({id, ""}); it != tracks_by_id_.end() && it->first == id;
       ++it) {
    tracks.push_back(it->second);
  }
  return tracks;
}

absl::StatusOr<Observation> FusedLayer::AsKept(const Observation& observation,
                                               const Snapshot& snapshot, std::string sent,
                                               std::string* body) const {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr layer, snapshot.GetLayer(layer_));
  const std::string& layer_frame = layer->spec().frame_id;
  HYPERMAP_ASSIGN_OR_RETURN(const std::string frame, snapshot.ResolveFrame(observation.frame_id));
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform layer_from_frame,
                            snapshot.frames.Lookup(layer_frame, frame));
  // Then Transformed would return the observation as it is, to the last bit.
  const bool is_in_place = layer_from_frame.IsIdentity() && observation.frame_id == layer_frame;
  *body = is_in_place ? std::move(sent)
                      : options_->codec.encode_observation(
                            Transformed(observation, layer_from_frame, layer_frame));
  // Folds the decoded bytes and not the message, because a restart or a rebuild folds these: both
  // must give the same state to the last bit.
  return options_->codec.decode_observation(*body);
}

absl::StatusOr<ObservationVerdict> FusedLayer::Admit(const Observation& observation, absl::Time now,
                                                     const Snapshot& snapshot, const Limits& limits,
                                                     RobotClocks* clocks) {
  std::optional<double> clock_skew_s;
  const auto verdict = [&](ObservationOutcome outcome, absl::string_view message) {
    return ObservationVerdict{observation.robot,    observation.sequence, outcome, 0,
                              std::string(message), clock_skew_s};
  };
  const auto invalid = [&](const absl::Status& status) {
    return verdict(ObservationOutcome::kInvalid,
                   absl::string_view(status.message().data(), status.message().size()));
  };
  if (absl::Status status = Validate(observation); !status.ok()) return invalid(status);
  // Hash of the message as sent, before the transform: a retry must be recognised even if the frame
  // has moved meanwhile.
  std::string sent = options_->codec.encode_observation(observation);
  const uint64_t hash = HashOf(sent);
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<uint64_t> known,
                            log_.FindContentHash(observation.robot, observation.sequence));
  if (known) {
    const bool is_same =
        *known == hash || (options_->codec.encode_observation_01 &&
                           *known == HashOf(options_->codec.encode_observation_01(observation)));
    if (is_same) return verdict(ObservationOutcome::kDuplicate, "is there already");
    return verdict(ObservationOutcome::kConflict,
                   "another observation of this robot and sequence is there already");
  }
  // Also of an observation that is refused for its stamp: its robot is the one that has to know.
  clock_skew_s = absl::ToDoubleSeconds(clocks->Add(observation.robot, observation.stamp, now));
  // An observation with a stamp far in the future would come after all others in the log until that
  // time has come.
  if (observation.stamp > now + options_->max_lateness) {
    return verdict(ObservationOutcome::kInvalid,
                   absl::StrCat("stamp lies ", absl::FormatDuration(observation.stamp - now),
                                " ahead of the server's clock, --max_lateness is ",
                                absl::FormatDuration(options_->max_lateness)));
  }
  // An observation is late relative to the newest one of its own robot; the clocks of other robots
  // do not count. A robot whose clock was ahead and has been corrected is judged by the server's
  // clock.
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<absl::Time> own,
                            log_.NewestStamp(observation.robot));
  if (own && observation.stamp < std::min(*own, now) - options_->max_lateness) {
    return verdict(ObservationOutcome::kRefusedLate,
                   absl::StrCat("stamp lies ", absl::FormatDuration(*own - observation.stamp),
                                " behind the robot's newest, --max_lateness is ",
                                absl::FormatDuration(options_->max_lateness)));
  }
  storage::LoggedObservation logged{KeyOf(observation), hash, now, ""};
  absl::StatusOr<Observation> kept = AsKept(observation, snapshot, std::move(sent), &logged.body);
  if (!kept.ok()) return invalid(kept.status());
  // Checked before the observation is in the log: an edit of Fold that failed would break the
  // group.
  const ExploredArea area(snapshot, settings_.exploration_layer, kept->frame_id);
  if (absl::Status status = area.Check(kept->free_space, limits); !status.ok()) {
    return invalid(status);
  }
  ChangedAt({logged.key, 0});
  ++new_entries_;
  explored_.push_back(kept->free_space);
  log_.Add(std::make_shared<const Observation>(*std::move(kept)), std::move(logged));
  return verdict(ObservationOutcome::kAccepted, "");
}

absl::StatusOr<FusedLayer::FoldedFacts> FusedLayer::FoldFacts(
    absl::Span<const OperatorEdit> edits) const {
  FoldedFacts folded;
  const std::unique_ptr<fusion::FactFold> fold = strategy_->FoldFacts(tip_.state);
  for (const auto& [kind, object] : edits) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    auto fact = std::make_shared<fusion::OperatorFact>(
        fusion::OperatorFact{kind, TrackOf(object->id), *object});
    fact->object.id = 0;
    fold->Add(*fact);
    folded.facts.push_back({object->id, std::move(fact)});
  }
  folded.state = fold->Finish();
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  return folded;
}

void FusedLayer::Tell(FoldedFacts folded) {
  if (folded.facts.empty()) return;
  storage::LogKey last;
  for (const auto& [id, fact] : folded.facts) {
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
    last = log_.Add(fact);
  }
  const auto num_facts = static_cast<int64_t>(folded.facts.size());
  new_entries_ += num_facts;
  // Changes before the facts make Fold start there and fold the facts again.
  if (changed_at_) return;
  Advance(last, std::move(folded.state), num_facts);
  tip_is_shown_ = false;
}

absl::StatusOr<int64_t> FusedLayer::Retract(const std::string& robot, absl::Time from,
                                            absl::Time to) {
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<ObservationKey> keys, log_.Retract(robot, from, to));
  for (const ObservationKey& key : keys) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    ChangedAt({key, 0});
    if (settings_.exploration_layer.empty()) continue;
    HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<const Observation> observation, log_.Get(key));
    not_explored_.push_back(observation->free_space);
  }
  return static_cast<int64_t>(keys.size());
}

absl::Status FusedLayer::Rebuild(const storage::FusionSettings& settings) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<fusion::Strategy> strategy,
                            options_->make_strategy(settings.strategy, settings.parameters));
  strategy_ = std::move(strategy);
  ChangedAt(storage::BeforeAll());
  // All stored checkpoints are invalid: makes Written store a new one.
  new_entries_ += options_->entries_per_stored_checkpoint;
  settings_ = settings;
  settings_changed_ = true;
  return absl::OkStatus();
}

void FusedLayer::SetExplorationLayer(const std::string& layer) {
  settings_.exploration_layer = layer;
  settings_changed_ = true;
}

void FusedLayer::ChangedAt(const storage::LogKey& key) {
  Earlier(key, &changed_at_);
  checkpoints_.erase(checkpoints_.lower_bound(key), checkpoints_.end());
  // A key after the tip invalidates no stored checkpoint.
  if (tip_.key < key) return;
  Earlier(key, &stale_from_);
  Earlier(key, &unwritten_stale_from_);
}

absl::StatusOr<FusedLayer::Checkpoint> FusedLayer::CheckpointBefore(const storage::LogKey& key) {
  const auto after = checkpoints_.lower_bound(key);
  if (after != checkpoints_.begin()) {
    return Checkpoint{std::prev(after)->first, std::prev(after)->second.state};
  }
  // The store still has checkpoints that changes of this group have made invalid.
  const storage::LogKey before = std::min(key, unwritten_stale_from_.value_or(key));
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<storage::FusionCheckpoint> stored,
                            stored_->FindCheckpoint(layer_, before));
  if (stored) {
    const absl::StatusOr<fusion::StatePtr> state = strategy_->Decode(stored->state);
    // A checkpoint of another version may not be readable. It is only a shortcut: the log has all.
    if (state.ok()) return Checkpoint{stored->key, *state};
  }
  return Checkpoint{storage::BeforeAll(), strategy_->Initial()};
}

absl::Status FusedLayer::FoldOn(Checkpoint from) {
  tip_ = std::move(from);
  // The facts since the last observation, which become one state. States between them would only
  // serve late observations that come between two facts.
  std::unique_ptr<fusion::FactFold> facts;
  storage::LogKey last_fact;
  int64_t num_facts = 0;
  const auto finish_facts = [&] {
    if (facts) Advance(last_fact, facts->Finish(), std::exchange(num_facts, 0));
    facts.reset();
  };
  HYPERMAP_RETURN_IF_ERROR(log_.Visit(tip_.key, [&](const Evidence& evidence) {
    if (evidence.fact) {
      if (!facts) facts = strategy_->FoldFacts(tip_.state);
      facts->Add(*evidence.fact);
      last_fact = evidence.key;
      ++num_facts;
      return;
    }
    finish_facts();
    Advance(evidence.key, strategy_->Fold(tip_.state, *evidence.observation, nullptr), 1);
  }));
  finish_facts();
  return absl::OkStatus();
}

void FusedLayer::Advance(const storage::LogKey& key, fusion::StatePtr state, int64_t num_entries) {
  tip_ = {key, std::move(state)};
  entries_folded_ += num_entries;
  entries_since_checkpoint_ += num_entries;
  if (entries_since_checkpoint_ >= options_->entries_per_checkpoint) AddCheckpoint();
}

void FusedLayer::AddCheckpoint() {
  entries_since_checkpoint_ = 0;
  checkpoints_.insert_or_assign(tip_.key, KeptState{tip_.state});
  CountUnshared(std::prev(checkpoints_.end()));
  if (checkpoints_.size() > kMaxCheckpoints) {
    auto it = checkpoints_.begin();
    for (size_t i = 0; i < kMaxCheckpoints / 4; ++i) {
      it = checkpoints_.erase(it);
      CountUnshared(it);
      ++it;
    }
  }
  TrimCheckpoints();
}

void FusedLayer::CountUnshared(Checkpoints::iterator newer) {
  if (newer == checkpoints_.begin()) return;
  KeptState& older = std::prev(newer)->second;
  older.unshared = strategy_->ByteSize(older.state, newer->second.state);
}

void FusedLayer::TrimCheckpoints() {
  int64_t bytes = 0;
  for (auto it = std::prev(checkpoints_.end()); it != checkpoints_.begin();) {
    bytes += (--it)->second.unshared;
    if (bytes <= options_->max_checkpoint_bytes) continue;
    checkpoints_.erase(checkpoints_.begin(), std::next(it));
    return;
  }
}

void FusedLayer::CountBytes() {
  bytes_ = strategy_->ByteSize(tip_.state, nullptr);
  if (checkpoints_.empty()) return;
  const auto newest = std::prev(checkpoints_.end());
  newest->second.unshared = strategy_->ByteSize(newest->second.state, tip_.state);
  for (const auto& [key, kept] : checkpoints_) bytes_ += kept.unshared;
}

absl::StatusOr<std::vector<Edit>> FusedLayer::Fold(const Snapshot& snapshot) {
  new_objects_.clear();
  std::vector<Edit> edits;
  if (changed_at_) {
    // Entries after the tip are folded onto it; earlier ones need a restart at a checkpoint.
    Checkpoint from = tip_;
    if (*changed_at_ <= tip_.key) {
      HYPERMAP_ASSIGN_OR_RETURN(Checkpoint before, CheckpointBefore(*changed_at_));
      from = std::move(before);
    }
    HYPERMAP_RETURN_IF_ERROR(FoldOn(std::move(from)));
    changed_at_.reset();
    tip_is_shown_ = false;
  }
  if (!tip_is_shown_) {
    CountBytes();
    Diff(snapshot, &edits);
    tip_is_shown_ = true;
  }
  HYPERMAP_RETURN_IF_ERROR(MarkExplored(snapshot, &edits));
  explored_.clear();
  not_explored_.clear();
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  return edits;
}

absl::Status FusedLayer::MarkExplored(const Snapshot& snapshot, std::vector<Edit>* edits) const {
  const Layer* layer = snapshot.FindLayer(layer_);
  if (layer == nullptr) return absl::OkStatus();
  const ExploredArea area(snapshot, settings_.exploration_layer, layer->spec().frame_id);
  for (const Polygon& polygon : explored_) area.Mark(polygon, edits);
  Box forgotten;
  for (const Polygon& polygon : not_explored_) {
    if (polygon.empty()) continue;
    area.Forget(polygon, edits);
    forgotten.Extend(polygon.bounds());
  }
  if (forgotten.empty()) return absl::OkStatus();
  // Cells do not count how many observations explored them, so that the remaining observations near
  // the retracted ones are marked again. Costs a pass over the log.
  return log_.Visit(storage::BeforeAll(), [&](const Evidence& evidence) {
    if (!evidence.observation || evidence.observation->free_space.empty()) return;
    const Polygon& free_space = evidence.observation->free_space;
    if (forgotten.Intersects(free_space.bounds())) area.Mark(free_space, edits);
  });
}

fusion::TrackKey FusedLayer::TrackOf(ObjectId id) const {
  const std::vector<fusion::TrackKey> tracks = TracksOf(id);
  for (const fusion::TrackKey& track : tracks) {
    const auto shown = shown_.find(track);
    if (shown != shown_.end() && shown->second.id == id) return track;
  }
  return tracks.empty() ? absl::StrCat("operator/", id) : tracks.front();
}

void FusedLayer::SetId(const fusion::TrackKey& track, ObjectId id) {
  ObjectId& own = ids_[track];
  tracks_by_id_.erase({own, track});
  tracks_by_id_.emplace(id, track);
  own = id;
  changed_tracks_.insert(track);
}

void FusedLayer::AdoptPinned(const std::vector<fusion::FusedObject>& fused) {
  std::optional<ThingIndex> things;
  for (const auto& [track, object] : std::exchange(pinned_, {})) {
    const auto own = shown_.find(track);
    if (own == shown_.end() || Holds(fused, track)) continue;
    if (!things) things = ThingsOf(fused);
    const std::optional<size_t> taken_over = things->Find(*object);
    if (!taken_over) {
      // The strategy shows no such object. The operator's stays on the map, without a track, so
      // that fusion never changes it.
      SetId(track, 0);
      shown_.erase(own);
      continue;
    }
    // The strategy gave the pin to another track. That track now shows the operator's object, under
    // the operator's id; its former object is left to a track that is gone, so that Diff removes
    // it.
    const fusion::TrackKey& by = fused[*taken_over].track;
    Shown& other = shown_[by];
    std::swap(other, own->second);
    SetId(by, other.id);
    if (own->second.id == 0) shown_.erase(own);
  }
}

void FusedLayer::Put(const fusion::FusedObject& fused, Shown* shown, std::vector<Edit>* edits) {
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

void FusedLayer::Diff(const Snapshot& snapshot, std::vector<Edit>* edits) {
  const std::vector<fusion::FusedObject> fused = strategy_->Objects(tip_.state);
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
    Show(object, &shown->second, edits);
    ++shown;
  }
  drop_until(nullptr);
  ThingIndex gone_things;
  for (size_t i = 0; i < gone.size(); ++i) {
    if (gone[i].id != 0) gone_things.Add(gone[i].object, i);
  }
  for (const fusion::FusedObject* object : come) {
    Shown& entry = shown_[object->track];
    if (ids_.count(object->track) == 0) Inherit(*object, &gone_things, &gone, &entry);
    Show(*object, &entry, edits);
  }
  Remove(gone, snapshot, edits);
}

void FusedLayer::Show(const fusion::FusedObject& fused, Shown* shown, std::vector<Edit>* edits) {
  // States share unchanged objects, so that most are equal by pointer.
  if (shown->object == fused.object) return;
  if (shown->object && *shown->object == *fused.object) {
    shown->object = fused.object;
    return;
  }
  if (Validate(*fused.object).ok()) Put(fused, shown, edits);
}

void FusedLayer::Inherit(const fusion::FusedObject& fused, ThingIndex* gone_things,
                         std::vector<Shown>* gone, Shown* shown) {
  const std::optional<size_t> same = gone_things->Take(*fused.object);
  if (!same) return;
  *shown = std::exchange((*gone)[*same], Shown());
  SetId(fused.track, shown->id);
}

void FusedLayer::Remove(const std::vector<Shown>& gone, const Snapshot& snapshot,
                        std::vector<Edit>* edits) {
  if (gone.empty()) return;
  // Another track may show the object by now, and an operator may have deleted it.
  std::set<ObjectId> kept = {0};
  for (const auto& [track, shown] : shown_) kept.insert(shown.id);
  const SemanticLayer* layer = snapshot.FindSemantic(layer_);
  for (const Shown& object : gone) {
    if (kept.insert(object.id).second && layer != nullptr && layer->Find(object.id)) {
      edits->push_back(DeleteObject{layer_, object.id});
    }
  }
}

storage::FusionChange FusedLayer::Finish(absl::Span<const ObjectId> object_ids) {
  for (const auto& [edit, track] : new_objects_) {
    shown_[track].id = object_ids[edit];
    SetId(track, object_ids[edit]);
  }
  new_objects_.clear();
  storage::FusionChange change;
  change.layer = layer_;
  if (std::exchange(settings_changed_, false)) change.settings = settings_;
  log_.TakeChange(&change);
  for (const fusion::TrackKey& track : std::exchange(changed_tracks_, {})) {
    change.tracks.emplace_back(track, ids_[track]);
  }
  change.stale_from = std::exchange(stale_from_, std::nullopt);
  return change;
}

absl::Status FusedLayer::Written() {
  unwritten_stale_from_.reset();
  log_.Written();
  return KeepCheckpoint(options_->entries_per_stored_checkpoint);
}

absl::Status FusedLayer::KeepCheckpoint(int64_t min_entries) {
  if (new_entries_ < min_entries) return absl::OkStatus();
  // It is only a shortcut: the log has all. Encoding takes several times a state's memory.
  if (strategy_->ByteSize(tip_.state, nullptr) > options_->max_checkpoint_bytes) {
    return absl::OkStatus();
  }
  absl::Status status = stored_->KeepCheckpoint(layer_, {tip_.key, strategy_->Encode(tip_.state)});
  if (status.ok()) new_entries_ = 0;
  return status;
}

}  // namespace hypermap::server
