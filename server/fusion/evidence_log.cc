#include "server/fusion/evidence_log.h"

#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap::server {
namespace {

// Number of entries that are read from the store at a time. A visitor may stop at any of them.
constexpr int kReadEntries = 16;
// Number of decoded entries that are kept in memory.
constexpr size_t kRecentEntries = 512;
// Number of robots whose newest stamp is kept in memory.
constexpr size_t kMaxNewestStamps = 1024;

}  // namespace

absl::StatusOr<EvidenceLog> EvidenceLog::Open(std::string layer, storage::FusionLog* stored,
                                              const EvidenceCodec* codec) {
  EvidenceLog log(std::move(layer), stored, codec);
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<ObservationKey> newest,
                            stored->NewestKey(log.layer_));
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<storage::LogKey> fact,
                            stored->NewestFact(log.layer_));
  if (fact) {
    log.last_ = *fact;
    log.num_facts_ = fact->number;
  }
  if (newest) log.last_ = std::max(log.last_, {*newest, 0});
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<storage::FusionBase> base,
                            stored->FindBase(log.layer_));
  if (base) {
    log.begin_ = base->key;
    log.last_ = std::max(log.last_, base->key);
    log.num_facts_ = std::max(log.num_facts_, base->num_facts);
  }
  log.complete_after_ = log.last_;
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<storage::LogEntry> corrections,
                            stored->FactsOfKind(log.layer_, kPosesKind));
  for (const storage::LogEntry& entry : corrections) {
    HYPERMAP_ASSIGN_OR_RETURN(Evidence evidence, DecodeEvidence(entry, *codec));
    log.corrections_.Add(entry.key, std::move(evidence.correction));
  }
  return log;
}

absl::StatusOr<std::optional<storage::FusionLog::Known>> EvidenceLog::FindObservation(
    const std::string& robot, int64_t sequence) const {
  if (const auto added = added_.find({robot, sequence}); added != added_.end()) {
    return storage::FusionLog::Known{added->second};
  }
  return stored_->FindObservation(layer_, robot, sequence);
}

absl::StatusOr<std::optional<absl::Time>> EvidenceLog::NewestStamp(const std::string& robot) {
  if (const auto known = newest_stamps_.find(robot); known != newest_stamps_.end()) {
    return known->second;
  }
  std::optional<absl::Time> newest;
  if (retracted_robots_.count(robot) == 0) {
    HYPERMAP_ASSIGN_OR_RETURN(newest, stored_->NewestStamp(layer_, robot));
  } else {
    // The store does not know yet that they are retracted.
    HYPERMAP_ASSIGN_OR_RETURN(
        const std::vector<ObservationKey> keys,
        stored_->KeysOf(layer_, robot, absl::InfinitePast(), absl::InfiniteFuture()));
    for (const ObservationKey& key : keys) {
      if (retracted_.count(key) == 0) newest = key.stamp;
    }
  }
  // The store does not have the newest entries yet.
  if (const auto added = added_stamps_.find(robot); added != added_stamps_.end()) {
    newest = std::max(newest.value_or(added->second), added->second);
  }
  if (newest_stamps_.size() >= kMaxNewestStamps) newest_stamps_.clear();
  newest_stamps_.emplace(robot, newest);
  return newest;
}

absl::StatusOr<std::vector<SequenceRange>> EvidenceLog::Sequences(const std::string& robot) const {
  return stored_->Sequences(layer_, robot);
}

void EvidenceLog::Add(std::shared_ptr<const Observation> observation,
                      storage::LoggedObservation logged) {
  added_.emplace(Name(logged.key.robot, logged.key.sequence), logged.content_hash);
  const absl::Time stamp = logged.key.stamp;
  absl::Time& newest_added = added_stamps_.emplace(logged.key.robot, stamp).first->second;
  newest_added = std::max(newest_added, stamp);
  const auto known = newest_stamps_.find(logged.key.robot);
  if (known != newest_stamps_.end()) {
    known->second = std::max(known->second.value_or(stamp), stamp);
  }
  const storage::LogKey key{logged.key, 0};
  last_ = std::max(last_, key);
  recent_.emplace(key, Recent{{key, std::move(observation), nullptr}});
  change_.observations.push_back(std::move(logged));
}

storage::LogKey EvidenceLog::Add(std::shared_ptr<const fusion::OperatorFact> fact) {
  storage::LogKey key{last_.after, ++num_facts_};
  last_ = key;
  change_.facts.push_back(EncodeFact(key, *fact, *codec_));
  recent_.emplace(key, Recent{{key, nullptr, std::move(fact)}});
  return key;
}

absl::Status EvidenceLog::CheckKept(const std::string& robot, absl::Time from,
                                    absl::string_view what) const {
  const absl::Time kept_after = begin_.after.stamp;
  if (begin_ == storage::BeforeAll() || from > kept_after) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_forgotten, stored_->HasForgotten(layer_, robot));
  if (!has_forgotten) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("evidence of ", absl::FormatTime(kept_after, absl::UTCTimeZone()),
                   " and before is no longer kept (--observation_age): observations of robot \"",
                   robot, "\" can be ", what, " from later times on only"));
}

absl::StatusOr<std::set<ObservationKey>> EvidenceLog::KeysOf(const std::string& robot,
                                                             absl::Time from, absl::Time to) const {
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<ObservationKey> stored,
                            stored_->KeysOf(layer_, robot, from, to));
  std::set<ObservationKey> keys(stored.begin(), stored.end());
  for (const auto& [key, recent] : recent_) {
    const ObservationKey& name = key.after;
    if (recent.stored.observation && name.robot == robot && name.stamp >= from && name.stamp < to) {
      keys.insert(name);
    }
  }
  std::erase_if(keys, [&](const ObservationKey& key) { return retracted_.count(key) > 0; });
  return keys;
}

absl::StatusOr<std::vector<ObservationKey>> EvidenceLog::Retract(const std::string& robot,
                                                                 absl::Time from, absl::Time to) {
  HYPERMAP_RETURN_IF_ERROR(CheckKept(robot, from, "retracted"));
  HYPERMAP_ASSIGN_OR_RETURN(const std::set<ObservationKey> keys, KeysOf(robot, from, to));
  const std::vector<ObservationKey> retracted(keys.begin(), keys.end());
  if (retracted.empty()) return retracted;
  retracted_.insert(keys.begin(), keys.end());
  change_.retracted.insert(change_.retracted.end(), keys.begin(), keys.end());
  newest_stamps_.erase(robot);
  retracted_robots_.insert(robot);
  added_stamps_.erase(robot);
  for (const auto& [key, recent] : recent_) {
    const ObservationKey& name = key.after;
    if (!recent.stored.observation || name.robot != robot || retracted_.count(name) > 0) continue;
    // In the order of their stamps. Entries that are stored already do no harm.
    added_stamps_[robot] = name.stamp;
  }
  return retracted;
}

absl::StatusOr<std::vector<ObservationKey>> EvidenceLog::Correct(const PoseCorrection& correction) {
  const std::string& robot = correction.robot;
  const absl::Time from = correction.poses.front().stamp;
  const absl::Time to = correction.poses.back().stamp + absl::Nanoseconds(1);
  HYPERMAP_RETURN_IF_ERROR(CheckKept(robot, from, "corrected"));
  HYPERMAP_ASSIGN_OR_RETURN(const std::set<ObservationKey> keys, KeysOf(robot, from, to));
  std::vector<ObservationKey> corrected;
  for (const ObservationKey& key : keys) {
    if (PoseAt(correction.poses, key.stamp)) corrected.push_back(key);
  }
  if (corrected.empty()) return corrected;
  const storage::LogKey key{last_.after, num_facts_ + 1};
  storage::LoggedFact fact = EncodeFact(key, correction, *codec_);
  // The decoded bytes are what a restart knows: both must move evidence to the same place, to the
  // last bit.
  HYPERMAP_ASSIGN_OR_RETURN(Evidence evidence,
                            DecodeEvidence({key, fact.kind, fact.track, fact.body}, *codec_));
  num_facts_ = key.number;
  last_ = key;
  corrections_.Add(key, evidence.correction);
  for (auto& [recent_key, recent] : recent_) {
    if (recent_key.after.robot == robot) recent.corrected.reset();
  }
  recent_.emplace(key, Recent{std::move(evidence)});
  change_.facts.push_back(std::move(fact));
  return corrected;
}

absl::StatusOr<std::shared_ptr<const Observation>> EvidenceLog::Get(
    const ObservationKey& key) const {
  const storage::LogKey log_key{key, 0};
  if (const auto it = recent_.find(log_key); it != recent_.end()) {
    return Corrected(it->second);
  }
  // The log is read after a key: this one is greater than all keys before log_key.
  storage::LogKey before = log_key;
  --before.after.sequence;
  before.number = std::numeric_limits<int64_t>::max();
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<storage::LogEntry> entries,
                            stored_->Read(layer_, before, 1));
  if (entries.empty() || entries.front().key != log_key) {
    return absl::DataLossError("an observation is not where the log has it");
  }
  HYPERMAP_ASSIGN_OR_RETURN(Evidence evidence, DecodeEvidence(entries.front(), *codec_));
  return corrections_.Apply(std::move(evidence.observation));
}

std::shared_ptr<const Observation> EvidenceLog::Corrected(const Recent& recent) const {
  if (!recent.corrected) recent.corrected = corrections_.Apply(recent.stored.observation);
  return recent.corrected;
}

absl::StatusOr<std::optional<Evidence>> EvidenceLog::Decode(const storage::LogEntry& entry) const {
  if (entry.key.number == 0 && retracted_.count(entry.key.after) > 0) return std::nullopt;
  HYPERMAP_ASSIGN_OR_RETURN(Evidence evidence, DecodeEvidence(entry, *codec_));
  if (evidence.observation) {
    evidence.observation = corrections_.Apply(std::move(evidence.observation));
  }
  return evidence;
}

absl::Status EvidenceLog::Visit(const storage::LogKey& after,
                                absl::FunctionRef<bool(const Evidence&)> visit) const {
  auto recent = recent_.upper_bound(after);
  bool goes_on = true;
  // Folding an entry takes milliseconds.
  const auto visit_recent = [&]() -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    Evidence evidence = recent->second.stored;
    if (!evidence.observation || retracted_.count(recent->first.after) == 0) {
      if (evidence.observation) evidence.observation = Corrected(recent->second);
      goes_on = visit(evidence);
    }
    ++recent;
    return absl::OkStatus();
  };
  // Merges the store and recent_, which are both ordered by key; after complete_after_, recent_ has
  // all entries.
  storage::LogKey at = after;
  while (goes_on && at < complete_after_) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<storage::LogEntry> entries,
                              stored_->Read(layer_, at, kReadEntries));
    for (const storage::LogEntry& entry : entries) {
      at = entry.key;
      if (at > complete_after_) break;
      while (goes_on && recent != recent_.end() && recent->first < at) {
        HYPERMAP_RETURN_IF_ERROR(visit_recent());
      }
      if (!goes_on) break;
      // The same entry in both: the decoded one is cheaper.
      if (recent != recent_.end() && recent->first == at) {
        HYPERMAP_RETURN_IF_ERROR(visit_recent());
      } else {
        HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
        HYPERMAP_ASSIGN_OR_RETURN(const std::optional<Evidence> evidence, Decode(entry));
        if (evidence) goes_on = visit(*evidence);
      }
      if (!goes_on) break;
    }
    if (entries.size() < kReadEntries) break;
  }
  while (goes_on && recent != recent_.end()) HYPERMAP_RETURN_IF_ERROR(visit_recent());
  return CheckCancelled();
}

void EvidenceLog::BeginAfter(const storage::LogKey& base) {
  begin_ = base;
  recent_.erase(recent_.begin(), recent_.upper_bound(base));
  complete_after_ = std::max(complete_after_, base);
  corrections_.RemoveUpTo(base);
}

void EvidenceLog::TakeChange(storage::FusionChange* change) {
  change->observations = std::exchange(change_.observations, {});
  change->retracted = std::exchange(change_.retracted, {});
  change->facts = std::exchange(change_.facts, {});
}

void EvidenceLog::Written() {
  added_.clear();
  added_stamps_.clear();
  for (const ObservationKey& key : retracted_) recent_.erase({key, 0});
  while (recent_.size() > kRecentEntries) {
    complete_after_ = std::max(complete_after_, recent_.begin()->first);
    recent_.erase(recent_.begin());
  }
  retracted_.clear();
  retracted_robots_.clear();
}

}  // namespace hypermap::server
