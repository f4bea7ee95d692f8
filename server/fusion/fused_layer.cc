#include "server/fusion/fused_layer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "server/fusion/explored_area.h"

namespace hypermap::server {
namespace {

constexpr size_t kMaxStoredCheckpoints = 8;
// Evidence is kept for FusionOptions::observation_age and, because a log can begin at a stored
// checkpoint only, up to a part of that longer.
constexpr int kBasesPerAge = 4;
// Entries of which the folding takes so long that a restart must not repeat it.
constexpr int64_t kLongWork = 4096;

// FNV-1a, 64 bits (Fowler, Noll, Vo). Hashes are stored, so that this function can't change.
uint64_t HashOf(absl::string_view bytes) {
  uint64_t hash = 0xcbf29ce484222325;
  for (const char c : bytes) hash = (hash ^ static_cast<uint8_t>(c)) * 0x100000001b3;
  return hash;
}

// Of stored checkpoints, ordered by key, those that may be dropped. Their stamps stand for their
// positions. Those that are older than max_lateness serve only as future bases of the log, but for
// the newest of them.
std::vector<storage::LogKey> DispensableOf(std::vector<storage::FusionLog::CheckpointKey> kept,
                                           const FusionOptions& options) {
  std::vector<storage::LogKey> dropped;
  const auto drop = [&](size_t i) {
    dropped.push_back(kept[i].key);
    kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(i));
  };
  const absl::Time late_from = kept.back().key.after.stamp - options.max_lateness;
  const absl::Duration between_bases = options.observation_age / kBasesPerAge;
  absl::Time next_base = options.observation_age < absl::InfiniteDuration()
                             ? absl::InfinitePast()
                             : absl::InfiniteFuture();
  size_t bases = 0;  // those at the front of `kept`
  while (bases + 1 < kept.size() && kept[bases + 1].key.after.stamp < late_from) {
    if (kept[bases].stored_at < next_base) {
      drop(bases);
    } else {
      next_base = kept[bases++].stored_at + between_bases;
    }
  }
  while (kept.size() > bases + kMaxStoredCheckpoints) {
    std::vector<int64_t> stamps_ns;
    stamps_ns.reserve(kept.size() - bases);
    for (size_t i = bases; i < kept.size(); ++i) {
      stamps_ns.push_back(absl::ToUnixNanos(kept[i].key.after.stamp));
    }
    drop(bases + MostDispensable(stamps_ns, stamps_ns.back()));
  }
  return dropped;
}

std::shared_ptr<RememberedSteps> NewSteps(const FusionOptions& options) {
  return std::make_shared<RememberedSteps>(options.max_checkpoint_bytes / 2);
}

void Earlier(const storage::LogKey& key, std::optional<storage::LogKey>* first) {
  if (!*first || key < **first) *first = key;
}

}  // namespace

FusedLayer::FusedLayer(std::string layer, storage::FusionSettings settings,
                       std::shared_ptr<const fusion::Strategy> strategy, EvidenceLog log,
                       storage::FusionLog* stored, const FusionOptions* options, FoldWork* work)
    : layer_(std::move(layer)),
      settings_(std::move(settings)),
      strategy_(std::move(strategy)),
      log_(std::move(log)),
      stored_(stored),
      options_(options),
      work_(work),
      shown_(layer_),
      steps_(NewSteps(*options)),
      fold_(strategy_, options, options->max_checkpoint_bytes, steps_, work_) {}

std::unique_ptr<FusedLayer> FusedLayer::Copy() const {
  std::unique_ptr<FusedLayer> copy(new FusedLayer(*this));
  for (std::optional<LateFold>& late : copy->late_) late.reset();
  return copy;
}

absl::StatusOr<std::unique_ptr<FusedLayer>> FusedLayer::Begin(
    const std::string& layer, const storage::FusionSettings& settings, storage::FusionLog* stored,
    const FusionOptions* options, FoldWork* work) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<fusion::Strategy> strategy,
                            options->make_strategy(settings.strategy, settings.parameters));
  HYPERMAP_ASSIGN_OR_RETURN(EvidenceLog log, EvidenceLog::Open(layer, stored, &options->codec));
  std::unique_ptr<FusedLayer> fused(
      new FusedLayer(layer, settings, std::move(strategy), std::move(log), stored, options, work));
  fused->settings_changed_ = true;
  return fused;
}

absl::StatusOr<std::unique_ptr<FusedLayer>> FusedLayer::Open(
    const std::string& layer, const storage::FusionSettings& settings, storage::FusionLog* stored,
    const FusionOptions* options, const Snapshot& snapshot, FoldWork* work) {
  absl::StatusOr<std::unique_ptr<FusedLayer>> fused = Begin(layer, settings, stored, options, work);
  // The caller of a later request did not choose the settings.
  if (absl::IsInvalidArgument(fused.status())) {
    return absl::DataLossError(
        absl::StrCat("stored settings of layer \"", layer, "\": ", fused.status().message()));
  }
  if (!fused.ok()) return fused;
  (*fused)->settings_changed_ = false;
  HYPERMAP_ASSIGN_OR_RETURN(
      FoldPoint checkpoint,
      (*fused)->CheckpointBefore(
          {{absl::FromUnixNanos(std::numeric_limits<int64_t>::max()), "", 0}, 0}));
  (*fused)->fold_.RestartAt(std::move(checkpoint));
  HYPERMAP_RETURN_IF_ERROR((*fused)->FoldOn());
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<storage::TrackId> tracks, stored->Tracks(layer));
  (*fused)->shown_.Load(tracks, snapshot, (*fused)->ObjectsOfTip());
  (*fused)->new_entries_ = (*fused)->fold_.tip().position;
  (*fused)->CountBytes();
  return fused;
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
  if (is_in_place) {
    *body = std::move(sent);
  } else {
    const Observation moved = Transformed(observation, layer_from_frame, layer_frame);
    // Where the view is now, what was seen may be too far away.
    if (moved.frame_from_view) HYPERMAP_RETURN_IF_ERROR(Validate(moved));
    *body = options_->codec.encode_observation(moved);
  }
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
  HYPERMAP_ASSIGN_OR_RETURN(std::optional<storage::FusionLog::Known> known,
                            log_.FindObservation(observation.robot, observation.sequence));
  if (!known && expected != nullptr) {
    const auto it = expected->known.find({observation.robot, observation.sequence});
    if (it != expected->known.end()) known = it->second;
  }
  if (known) {
    if (!known->content_hash) {
      return verdict(ObservationOutcome::kDuplicate,
                     "an observation of this robot and sequence was there; it is no longer kept");
    }
    const bool is_same =
        known->content_hash == hash ||
        (options_->codec.encode_observation_01 &&
         known->content_hash == HashOf(options_->codec.encode_observation_01(observation)));
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
  if (storage::LogKey{KeyOf(observation), 0} <= log_.begin()) {
    return verdict(ObservationOutcome::kRefusedLate,
                   absl::StrCat("the layer no longer keeps the evidence of ",
                                absl::FormatTime(log_.begin().after.stamp, absl::UTCTimeZone()),
                                " and before, --observation_age is ",
                                absl::FormatDuration(options_->observation_age)));
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
  auto observed = std::make_shared<const Observation>(*std::move(kept));
  if (absl::Status status = area.Check(log_.corrections().Apply(observed)->free_space, limits);
      !status.ok()) {
    return invalid(status);
  }
  Judged judged = verdict(ObservationOutcome::kAccepted, "");
  judged.kept = std::move(observed);
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
  explored_.push_back(log_.corrections().Apply(judged.kept)->free_space);
  log_.Add(std::move(judged.kept), std::move(judged.logged));
  return std::move(judged.verdict);
}

absl::StatusOr<int64_t> FusedLayer::EntriesToFold(const Observation& observation) const {
  const storage::LogKey key{KeyOf(observation), 0};
  if (fold_.tip().key < key) return 1;
  HYPERMAP_ASSIGN_OR_RETURN(const auto known,
                            log_.FindObservation(observation.robot, observation.sequence));
  return known ? 0 : EntriesAfter(key);
}

int64_t FusedLayer::EntriesAfter(const storage::LogKey& key) const {
  const FoldPoint& tip = fold_.tip();
  if (tip.key < key) return 0;
  const std::optional<FoldPoint> before = fold_.checkpoints().Before(key);
  if (!before) return kAllEntries;
  const int64_t entries = tip.position - before->position;
  const int64_t known = std::min(entries, static_cast<int64_t>(steps_->NumAfter(before->key)));
  return entries - known + static_cast<int64_t>(std::ceil(steps_->FoldsFor(known)));
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
    expected.known[{key.after.robot, key.after.sequence}] = {judged.logged.content_hash};
    absl::Time& newest = expected.newest.emplace(key.after.robot, key.after.stamp).first->second;
    newest = std::max(newest, key.after.stamp);
    late[key] = {log_.corrections().Apply(std::move(judged.kept)), std::move(judged.logged.body)};
  }
  if (late.empty()) return false;
  HYPERMAP_ASSIGN_OR_RETURN(FoldPoint before, CheckpointBefore(late.begin()->first));
  LogFold start(strategy_, options_, options_->max_checkpoint_bytes / kNumLanes, steps_, work_);
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
    if (kind == fusion::OperatorFact::Kind::kRemove && shown_.HasLostItsTrack(object->id)) continue;
    auto fact = std::make_shared<fusion::OperatorFact>(
        fusion::OperatorFact{kind, shown_.TrackOf(object->id), *object});
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
    shown_.Tell(fact, id);
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

absl::StatusOr<int64_t> FusedLayer::Correct(const PoseCorrection& correction) {
  const bool explores = !settings_.exploration_layer.empty();
  const EvidenceLog before = log_;
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<ObservationKey> keys, log_.Correct(correction));
  for (const ObservationKey& key : keys) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    ChangedAt({key, 0});
    if (!explores) continue;
    HYPERMAP_ASSIGN_OR_RETURN(const auto was, before.Get(key));
    HYPERMAP_ASSIGN_OR_RETURN(const auto is, log_.Get(key));
    not_explored_.push_back(was->free_space);
    explored_.push_back(is->free_space);
  }
  // Late observations may be corrected, too.
  if (!keys.empty()) {
    for (std::optional<LateFold>& late : late_) late.reset();
    ++new_entries_;
  }
  return static_cast<int64_t>(keys.size());
}

absl::Status FusedLayer::Rebuild(const storage::FusionSettings& settings) {
  if (settings.strategy != settings_.strategy && log_.begin() != storage::BeforeAll()) {
    return absl::FailedPreconditionError(absl::StrCat(
        "evidence of ", absl::FormatTime(log_.begin().after.stamp, absl::UTCTimeZone()),
        " and before is no longer kept (--observation_age): the strategy \"", settings.strategy,
        "\" can't go on from what \"", settings_.strategy, "\" made of it"));
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<fusion::Strategy> strategy,
                            options_->make_strategy(settings.strategy, settings.parameters));
  ChangedAt(storage::BeforeAll());
  strategy_ = std::move(strategy);
  steps_ = NewSteps(*options_);
  shown_state_ = nullptr;
  fold_ = LogFold(strategy_, options_, options_->max_checkpoint_bytes, steps_, work_);
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
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<storage::FusionBase> base,
                            stored_->FindBase(layer_));
  return BeginningOfLog(base, *strategy_);
}

void FusedLayer::Forget(const storage::LogKey& base) {
  log_.BeginAfter(base);
  fold_.DropBefore(base);
  // They may have begun with what is forgotten. What is judged late once more begins again.
  for (std::optional<LateFold>& late : late_) late.reset();
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
  bytes_ = fold_.Bytes() + steps_->bytes() + log_.corrections().bytes();
  for (const std::optional<LateFold>& late : late_) {
    if (late) bytes_ += late->fold().Bytes();
  }
}

void FusedLayer::ShowTip(const Snapshot& snapshot, std::vector<Edit>* edits) {
  const fusion::StatePtr& tip = fold_.tip().state;
  std::optional<std::vector<fusion::FusedObject>> changed;
  if (shown_state_ && !shown_.was_told()) changed = strategy_->ChangedObjects(shown_state_, tip);
  if (changed) {
    shown_.ShowChanges(*changed, snapshot, edits);
  } else {
    shown_.Show(ObjectsOfTip(), snapshot, edits);
  }
  shown_state_ = tip;
  tip_is_shown_ = true;
}

absl::StatusOr<std::vector<Edit>> FusedLayer::Fold(const Snapshot& snapshot) {
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
    ShowTip(snapshot, &edits);
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
  // the retracted ones are marked again. Of what only forgotten observations saw, robots look at it
  // once more. Costs a pass over the log.
  return log_.Visit(log_.begin(), [&](const Evidence& evidence) {
    if (!evidence.observation || evidence.observation->free_space.empty()) return true;
    const Polygon& free_space = evidence.observation->free_space;
    if (forgotten.Intersects(free_space.bounds())) area.Mark(free_space, edits);
    return true;
  });
}

storage::FusionChange FusedLayer::Finish(absl::Span<const ObjectId> object_ids) {
  shown_.Assign(object_ids);
  storage::FusionChange change;
  change.layer = layer_;
  if (std::exchange(settings_changed_, false)) change.settings = settings_;
  log_.TakeChange(&change);
  change.tracks = shown_.TakeChanges();
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
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<storage::FusionLog::CheckpointKey> kept,
                            stored_->Checkpoints(layer_));
  const absl::Time now = options_->commit_clock ? options_->commit_clock() : absl::InfiniteFuture();
  kept.push_back({tip.key, now});
  absl::Status status =
      stored_->KeepCheckpoint(layer_, {tip.key, strategy_->Encode(tip.state), now},
                              DispensableOf(std::move(kept), *options_));
  if (status.ok()) new_entries_ = 0;
  return status;
}

}  // namespace hypermap::server
