#include "server/fusion/fused_layer.h"

#include <algorithm>
#include <iterator>
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

constexpr size_t kMaxStoredCheckpoints = 8;
// Entries of which the folding takes so long that a restart must not repeat it.
constexpr int64_t kLongWork = 4096;

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

// Of stored checkpoints, ordered by key, those that may be dropped. Their stamps stand for their
// positions.
std::vector<storage::LogKey> DispensableOf(std::vector<storage::LogKey> keys,
                                           absl::Duration max_age) {
  std::vector<storage::LogKey> dropped;
  const auto drop = [&](size_t i) {
    dropped.push_back(keys[i]);
    keys.erase(keys.begin() + static_cast<std::ptrdiff_t>(i));
  };
  const absl::Time newest = keys.back().after.stamp;
  while (keys.size() >= 2 && keys[1].after.stamp < newest - max_age) drop(0);
  while (keys.size() > kMaxStoredCheckpoints) {
    std::vector<int64_t> stamps_ns;
    stamps_ns.reserve(keys.size());
    for (const storage::LogKey& key : keys) stamps_ns.push_back(absl::ToUnixNanos(key.after.stamp));
    drop(MostDispensable(stamps_ns, stamps_ns.back()));
  }
  return dropped;
}

void Earlier(const storage::LogKey& key, std::optional<storage::LogKey>* first) {
  if (!*first || key < **first) *first = key;
}

}  // namespace

FusedLayer::FusedLayer(std::string layer, storage::FusionSettings settings,
                       std::shared_ptr<const fusion::Strategy> strategy, EvidenceLog log,
                       storage::FusionLog* stored, const FusionOptions* options)
    : layer_(std::move(layer)),
      settings_(std::move(settings)),
      strategy_(std::move(strategy)),
      log_(std::move(log)),
      stored_(stored),
      options_(options),
      fold_(strategy_, options, options->max_checkpoint_bytes) {}

std::unique_ptr<FusedLayer> FusedLayer::Copy() const {
  std::unique_ptr<FusedLayer> copy(new FusedLayer(*this));
  for (std::optional<LateFold>& late : copy->late_) late.reset();
  return copy;
}

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
  HYPERMAP_ASSIGN_OR_RETURN(
      FoldPoint checkpoint,
      (*fused)->CheckpointBefore(
          {{absl::FromUnixNanos(std::numeric_limits<int64_t>::max()), "", 0}, 0}));
  (*fused)->fold_.RestartAt(std::move(checkpoint));
  HYPERMAP_RETURN_IF_ERROR((*fused)->FoldOn());
  HYPERMAP_RETURN_IF_ERROR((*fused)->LoadShown(snapshot));
  (*fused)->new_entries_ = (*fused)->fold_.tip().position;
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
  // Of the tracks that have shown an object, the strategy shows one at most. If it shows none, the
  // next Diff removes the object.
  std::set<ObjectId> of_tip;
  const std::vector<fusion::FusedObject> fused = strategy_->Objects(fold_.tip().state);
  for (const fusion::FusedObject& object : fused) {
    const auto shown = shown_.find(object.track);
    if (shown != shown_.end()) of_tip.insert(shown->second.id);
  }
  for (auto it = shown_.begin(); it != shown_.end();) {
    const bool is_former = of_tip.count(it->second.id) > 0 && !Holds(fused, it->first);
    it = is_former ? shown_.erase(it) : std::next(it);
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

absl::StatusOr<FusedLayer::Judged> FusedLayer::Judge(const Observation& observation, absl::Time now,
                                                     const Snapshot& snapshot, const Limits& limits,
                                                     const Expected* expected,
                                                     RobotClocks* clocks) {
  std::optional<double> clock_skew_s;
  const auto verdict = [&](ObservationOutcome outcome, absl::string_view message) {
    return Judged{
        {observation.robot, observation.sequence, outcome, 0, std::string(message), clock_skew_s}};
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
  HYPERMAP_ASSIGN_OR_RETURN(std::optional<uint64_t> known,
                            log_.FindContentHash(observation.robot, observation.sequence));
  if (!known && expected != nullptr) {
    const auto it = expected->hashes.find({observation.robot, observation.sequence});
    if (it != expected->hashes.end()) known = it->second;
  }
  if (known) {
    const bool is_same =
        *known == hash || (options_->codec.encode_observation_01 &&
                           *known == HashOf(options_->codec.encode_observation_01(observation)));
    if (is_same) return verdict(ObservationOutcome::kDuplicate, "is there already");
    return verdict(ObservationOutcome::kConflict,
                   "another observation of this robot and sequence is there already");
  }
  // Also of an observation that is refused for its stamp: its robot is the one that has to know.
  if (clocks != nullptr) {
    clock_skew_s = absl::ToDoubleSeconds(clocks->Add(observation.robot, observation.stamp, now));
  }
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
  HYPERMAP_ASSIGN_OR_RETURN(std::optional<absl::Time> own, log_.NewestStamp(observation.robot));
  if (expected != nullptr) {
    const auto it = expected->newest.find(observation.robot);
    if (it != expected->newest.end()) own = std::max(own.value_or(it->second), it->second);
  }
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
  Judged judged = verdict(ObservationOutcome::kAccepted, "");
  judged.kept = std::make_shared<const Observation>(*std::move(kept));
  judged.logged = std::move(logged);
  return judged;
}

absl::StatusOr<ObservationVerdict> FusedLayer::Admit(const Observation& observation, absl::Time now,
                                                     const Snapshot& snapshot, const Limits& limits,
                                                     RobotClocks* clocks) {
  HYPERMAP_ASSIGN_OR_RETURN(Judged judged,
                            Judge(observation, now, snapshot, limits, nullptr, clocks));
  if (!judged.kept) return std::move(judged.verdict);
  const storage::LogKey key{judged.logged.key, 0};
  ChangedAt(key);
  ChangeLate(key, judged.logged.body);
  ++new_entries_;
  explored_.push_back(judged.kept->free_space);
  log_.Add(std::move(judged.kept), std::move(judged.logged));
  return std::move(judged.verdict);
}

absl::StatusOr<int64_t> FusedLayer::EntriesToFold(const Observation& observation) const {
  const storage::LogKey key{KeyOf(observation), 0};
  if (fold_.tip().key < key) return 1;
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<uint64_t> known,
                            log_.FindContentHash(observation.robot, observation.sequence));
  return known ? 0 : EntriesAfter(key);
}

int64_t FusedLayer::EntriesAfter(const storage::LogKey& key) const {
  const FoldPoint& tip = fold_.tip();
  if (tip.key < key) return 0;
  const std::optional<FoldPoint> before = fold_.checkpoints().Before(key);
  return before ? tip.position - before->position : kAllEntries;
}

absl::StatusOr<bool> FusedLayer::BeginLate(Lane lane,
                                           absl::Span<const LateObservation> observations,
                                           const Snapshot& snapshot, const Limits& limits) {
  std::optional<LateFold>& work = late_[static_cast<int>(lane)];
  work.reset();
  std::map<storage::LogKey, LateFold::Late> late;
  Expected expected;
  for (const auto& [observation, now] : observations) {
    HYPERMAP_ASSIGN_OR_RETURN(Judged judged,
                              Judge(*observation, now, snapshot, limits, &expected, nullptr));
    if (!judged.kept) continue;
    const storage::LogKey key{judged.logged.key, 0};
    expected.hashes[{key.after.robot, key.after.sequence}] = judged.logged.content_hash;
    absl::Time& newest = expected.newest.emplace(key.after.robot, key.after.stamp).first->second;
    newest = std::max(newest, key.after.stamp);
    late[key] = {std::move(judged.kept), std::move(judged.logged.body)};
  }
  if (late.empty()) return false;
  HYPERMAP_ASSIGN_OR_RETURN(FoldPoint before, CheckpointBefore(late.begin()->first));
  LogFold start(strategy_, options_, options_->max_checkpoint_bytes / kNumLanes);
  start.RestartAt(std::move(before));
  work.emplace(std::move(start), std::move(late));
  return true;
}

absl::StatusOr<int64_t> FusedLayer::ContinueLate(Lane lane, absl::FunctionRef<bool()> stop) {
  LateFold& late = *late_[static_cast<int>(lane)];
  const absl::StatusOr<bool> at_end = late.Continue(log_, stop);
  if (!at_end.ok()) {
    late_[static_cast<int>(lane)].reset();
    return at_end.status();
  }
  CountBytes();
  return *at_end ? 0 : EntriesAfter(late.fold().tip().key);
}

absl::StatusOr<FusedLayer::FoldedFacts> FusedLayer::FoldFacts(
    absl::Span<const OperatorEdit> edits) const {
  FoldedFacts folded;
  const std::unique_ptr<fusion::FactFold> fold = strategy_->FoldFacts(fold_.tip().state);
  for (const auto& [kind, object] : edits) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    // The fact would remove the other object, which is in the same place.
    if (kind == fusion::OperatorFact::Kind::kRemove && HasLostItsTrack(object->id)) continue;
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
    ChangeLate(last, std::nullopt);
  }
  const auto num_facts = static_cast<int64_t>(folded.facts.size());
  new_entries_ += num_facts;
  // Changes before the facts make Fold start there and fold the facts again.
  if (changed_at_) return;
  fold_.Advance(last, std::move(folded.state), num_facts);
  tip_is_shown_ = false;
}

absl::StatusOr<int64_t> FusedLayer::Retract(const std::string& robot, absl::Time from,
                                            absl::Time to) {
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<ObservationKey> keys, log_.Retract(robot, from, to));
  for (const ObservationKey& key : keys) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    ChangedAt({key, 0});
    ChangeLate({key, 0}, std::nullopt);
    if (settings_.exploration_layer.empty()) continue;
    HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<const Observation> observation, log_.Get(key));
    not_explored_.push_back(observation->free_space);
  }
  return static_cast<int64_t>(keys.size());
}

absl::Status FusedLayer::Rebuild(const storage::FusionSettings& settings) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<fusion::Strategy> strategy,
                            options_->make_strategy(settings.strategy, settings.parameters));
  ChangedAt(storage::BeforeAll());
  strategy_ = std::move(strategy);
  fold_ = LogFold(strategy_, options_, options_->max_checkpoint_bytes);
  for (std::optional<LateFold>& late : late_) late.reset();
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
  fold_.DropFrom(key);
  // A key after the tip invalidates no stored checkpoint.
  if (fold_.tip().key < key) return;
  Earlier(key, &stale_from_);
  Earlier(key, &unwritten_stale_from_);
}

void FusedLayer::ChangeLate(const storage::LogKey& key, std::optional<absl::string_view> body) {
  for (std::optional<LateFold>& late : late_) {
    if (!late) continue;
    const bool goes_on = body ? late->Arrived(key, *body) : late->Changed(key);
    if (!goes_on) late.reset();
  }
}

absl::StatusOr<FoldPoint> FusedLayer::CheckpointBefore(const storage::LogKey& key) {
  if (std::optional<FoldPoint> kept = fold_.checkpoints().Before(key)) return *std::move(kept);
  // The store still has checkpoints that changes of this group have made invalid.
  const storage::LogKey before = std::min(key, unwritten_stale_from_.value_or(key));
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<storage::FusionCheckpoint> stored,
                            stored_->FindCheckpoint(layer_, before));
  if (stored) {
    const absl::StatusOr<fusion::StatePtr> state = strategy_->Decode(stored->state);
    // A checkpoint of another version may not be readable. It is only a shortcut: the log has all.
    if (state.ok()) return FoldPoint{stored->key, *state};
  }
  return FoldPoint{storage::BeforeAll(), strategy_->Initial()};
}

absl::Status FusedLayer::FoldOn() {
  EntryFolder folder(&fold_);
  HYPERMAP_RETURN_IF_ERROR(log_.Visit(fold_.tip().key, [&](const Evidence& evidence) {
    folder.Fold(evidence);
    return true;
  }));
  folder.Finish();
  return absl::OkStatus();
}

bool FusedLayer::TakeLate() {
  const std::optional<FoldPoint> newest = fold_.checkpoints().Newest();
  storage::LogKey reached = newest ? newest->key : storage::BeforeAll();
  bool taken = false;
  for (std::optional<LateFold>& late : late_) {
    if (!late || !late->has_arrivals()) continue;
    const LogFold* work = late->Take();
    if (work != nullptr && reached < work->tip().key) {
      fold_.TakeOver(*work);
      reached = work->tip().key;
      taken = true;
      // Stored checkpoints have become invalid. After long work, Written stores another one at
      // once: a restart must not take as long.
      if (late->num_folded() >= kLongWork) new_entries_ += late->num_folded();
    }
    late.reset();
  }
  return taken;
}

void FusedLayer::CountBytes() {
  bytes_ = fold_.Bytes();
  for (const std::optional<LateFold>& late : late_) {
    if (late) bytes_ += late->fold().Bytes();
  }
}

absl::StatusOr<std::vector<Edit>> FusedLayer::Fold(const Snapshot& snapshot) {
  new_objects_.clear();
  std::vector<Edit> edits;
  if (changed_at_) {
    // Entries after the tip are folded onto it; earlier ones need a restart at a checkpoint.
    if (*changed_at_ <= fold_.tip().key && !TakeLate()) {
      HYPERMAP_ASSIGN_OR_RETURN(FoldPoint before, CheckpointBefore(*changed_at_));
      fold_.RestartAt(std::move(before));
    }
    HYPERMAP_RETURN_IF_ERROR(FoldOn());
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
    if (!evidence.observation || evidence.observation->free_space.empty()) return true;
    const Polygon& free_space = evidence.observation->free_space;
    if (forgotten.Intersects(free_space.bounds())) area.Mark(free_space, edits);
    return true;
  });
}

fusion::TrackKey FusedLayer::TrackOf(ObjectId id) const {
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

bool FusedLayer::HasLostItsTrack(ObjectId id) const {
  return TracksOf(id).empty() && IsTrackOfAnother(FirstTrackOf(id), id);
}

bool FusedLayer::IsTrackOfAnother(const fusion::TrackKey& track, ObjectId id) const {
  const auto known = ids_.find(track);
  return known != ids_.end() && known->second != 0 && known->second != id;
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
      for (const fusion::TrackKey& former : TracksOf(own->second.id)) SetId(former, 0);
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
  const std::vector<fusion::FusedObject> fused = strategy_->Objects(fold_.tip().state);
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
  const FoldPoint& tip = fold_.tip();
  // It is only a shortcut: the log has all. Encoding takes several times a state's memory.
  if (strategy_->ByteSize(tip.state, nullptr) > options_->max_checkpoint_bytes) {
    return absl::OkStatus();
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<storage::LogKey> keys, stored_->CheckpointKeys(layer_));
  keys.push_back(tip.key);
  absl::Status status = stored_->KeepCheckpoint(layer_, {tip.key, strategy_->Encode(tip.state)},
                                                DispensableOf(keys, options_->max_lateness));
  if (status.ok()) new_entries_ = 0;
  return status;
}

}  // namespace hypermap::server
