#include "storage/conformance/testing/evidence_model.h"

#include <algorithm>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap::storage {

using ::hypermap::testing::Rng;
using ::hypermap::testing::UniformInt;

namespace {

// In the order of their bytes, which is not that of a dictionary.
constexpr const char* kRobots[] = {"Z", "a", "robot 2", "ä"};

std::string RandomRobot(Rng& rng) { return kRobots[UniformInt(rng, 0, 3)]; }

std::string RandomBytes(Rng& rng, int max_size) {
  std::string bytes(UniformInt(rng, 0, max_size), '\0');
  for (char& byte : bytes) byte = static_cast<char>(UniformInt(rng, 0, 255));
  return bytes;
}

bool operator==(const LogEntry& a, const LogEntry& b) {
  return a.key == b.key && a.kind == b.kind && a.track == b.track && a.body == b.body;
}

// Expects a checkpoint or its absence.
void ExpectCheckpoint(const absl::StatusOr<std::optional<FusionCheckpoint>>& actual,
                      const std::optional<FusionCheckpoint>& expected) {
  ASSERT_TRUE(actual.ok()) << actual.status();
  ASSERT_EQ(actual->has_value(), expected.has_value());
  if (!expected) return;
  EXPECT_EQ((*actual)->key, expected->key);
  EXPECT_EQ((*actual)->state, expected->state);
  EXPECT_EQ((*actual)->stored_at, expected->stored_at);
}

}  // namespace

LogKey EvidenceModel::Last() const {
  LogKey last = base_ ? base_->key : BeforeAll();
  for (const auto& [name, stored] : observations_) {
    if (!stored.retracted) last = std::max(last, LogKey{stored.observation.key, 0});
  }
  if (!facts_.empty()) last = std::max(last, facts_.rbegin()->first);
  return last;
}

LogKey EvidenceModel::RandomKey(Rng& rng) const {
  const std::vector<LogEntry> entries = Entries();
  if (entries.empty() || UniformInt(rng, 0, 4) == 0) {
    return {{absl::FromUnixNanos(UniformInt(rng, -60, 260)), RandomRobot(rng), 5}, 0};
  }
  return entries[UniformInt(rng, 0, static_cast<int>(entries.size()) - 1)].key;
}

void EvidenceModel::AddObservations(Rng& rng, FusionChange* change) const {
  std::set<Name> taken;
  for (int i = UniformInt(rng, 0, 6); i > 0; --i) {
    const Name name(RandomRobot(rng), UniformInt(rng, -20, 60));
    const ObservationKey key{absl::FromUnixNanos(UniformInt(rng, -50, 250)), name.first,
                             name.second};
    if (IsForgotten({key, 0}) || observations_.contains(name) || forgotten_.contains(name)) {
      continue;
    }
    if (!taken.insert(name).second) continue;
    change->observations.push_back({key, rng(), absl::FromUnixNanos(99), RandomBytes(rng, 300)});
  }
}

FusionChange EvidenceModel::RandomChange(Rng& rng, const std::string& layer) const {
  FusionChange change{.layer = layer};
  if (!settings_ || UniformInt(rng, 0, 9) == 0) {
    change.settings =
        FusionSettings{"evidence", absl::StrCat("{\"a\":", UniformInt(rng, 0, 9), "}"),
                       UniformInt(rng, 0, 1) == 0 ? "" : "explored"};
  }
  AddObservations(rng, &change);
  for (const auto& [name, stored] : observations_) {
    const ObservationKey& key = stored.observation.key;
    if (!stored.retracted && !IsForgotten({key, 0}) && UniformInt(rng, 0, 19) == 0) {
      change.retracted.push_back(key);
    }
  }
  for (int i = UniformInt(rng, 0, 3) - 1, number = num_facts_ + 1; i > 0; --i, ++number) {
    change.facts.push_back({{Last().after, number}, "pin", RandomRobot(rng), RandomBytes(rng, 40)});
  }
  for (int i = UniformInt(rng, 0, 2); i > 0; --i) {
    change.tracks.emplace_back(absl::StrCat("track ", i), UniformInt(rng, 0, 50));
  }
  if (UniformInt(rng, 0, 5) == 0) change.stale_from = RandomKey(rng);
  return change;
}

void EvidenceModel::Apply(const FusionChange& change) {
  if (change.settings) settings_ = change.settings;
  if (change.stale_from) {
    checkpoints_.erase(checkpoints_.lower_bound(*change.stale_from), checkpoints_.end());
  }
  for (const LoggedObservation& observation : change.observations) {
    observations_[{observation.key.robot, observation.key.sequence}] = {observation, false};
  }
  for (const ObservationKey& key : change.retracted) {
    observations_.at({key.robot, key.sequence}).retracted = true;
  }
  for (const LoggedFact& fact : change.facts) {
    facts_[fact.key] = fact;
    num_facts_ = std::max(num_facts_, fact.key.number);
  }
  for (const auto& [track, id] : change.tracks) tracks_[track] = id;
}

std::pair<FusionCheckpoint, std::vector<LogKey>> EvidenceModel::RandomCheckpoint(Rng& rng) const {
  LogKey key = RandomKey(rng);
  if (IsForgotten(key)) key = {{base_->key.after.stamp + absl::Nanoseconds(1), "", 0}, 0};
  std::vector<LogKey> dropped;
  for (const auto& [other, checkpoint] : checkpoints_) {
    if (other != key && UniformInt(rng, 0, 5) == 0) dropped.push_back(other);
  }
  return {{key, RandomBytes(rng, 2000), absl::FromUnixNanos(UniformInt(rng, 0, 100))}, dropped};
}

void EvidenceModel::Keep(const FusionCheckpoint& checkpoint, const std::vector<LogKey>& dropped) {
  checkpoints_[checkpoint.key] = checkpoint;
  for (const LogKey& key : dropped) checkpoints_.erase(key);
}

std::optional<FusionCheckpoint> EvidenceModel::NextBase(absl::Time stored_before) const {
  std::optional<FusionCheckpoint> next;
  for (const auto& [key, checkpoint] : checkpoints_) {
    // With a state from before all observations nothing would be forgotten.
    if (key.after == BeforeAll().after || IsForgotten(key)) continue;
    if (checkpoint.stored_at < stored_before) next = checkpoint;
  }
  return next;
}

void EvidenceModel::MoveBase(const LogKey& checkpoint) {
  FusionBase base{checkpoint, base_ ? base_->num_facts : 0, checkpoints_.at(checkpoint).state};
  for (const auto& [key, fact] : facts_) {
    if (key <= checkpoint) base.num_facts = std::max(base.num_facts, key.number);
  }
  base_ = std::move(base);
  checkpoints_.erase(checkpoints_.begin(), checkpoints_.upper_bound(checkpoint));
  is_settled_ = false;
}

void EvidenceModel::RemoveForgotten() {
  is_settled_ = true;
  if (!base_) return;
  facts_.erase(facts_.begin(), facts_.upper_bound(base_->key));
  for (auto it = observations_.begin(); it != observations_.end();) {
    const bool is_forgotten = IsForgotten({it->second.observation.key, 0});
    if (is_forgotten) forgotten_.insert(it->first);
    it = is_forgotten ? observations_.erase(it) : std::next(it);
  }
}

std::vector<LogEntry> EvidenceModel::Entries() const {
  std::vector<LogEntry> entries;
  for (const auto& [name, stored] : observations_) {
    const LogKey key{stored.observation.key, 0};
    if (!stored.retracted && !IsForgotten(key)) {
      entries.push_back({key, "", "", stored.observation.body});
    }
  }
  for (const auto& [key, fact] : facts_) {
    if (!IsForgotten(key)) entries.push_back({key, fact.kind, fact.track, fact.body});
  }
  std::sort(entries.begin(), entries.end(),
            [](const LogEntry& a, const LogEntry& b) { return a.key < b.key; });
  return entries;
}

std::vector<ObservationKey> EvidenceModel::KeysOf(const std::string& robot, absl::Time from,
                                                  absl::Time to) const {
  std::vector<ObservationKey> keys;
  for (const LogEntry& entry : Entries()) {
    const ObservationKey& key = entry.key.after;
    if (entry.key.number == 0 && key.robot == robot && from <= key.stamp && key.stamp < to) {
      keys.push_back(key);
    }
  }
  return keys;
}

void EvidenceModel::ExpectSame(Rng& rng, FusionLog& log, const std::string& layer) const {
  SCOPED_TRACE(::testing::Message() << "evidence of " << layer);
  absl::StatusOr<std::vector<TrackId>> tracks = log.Tracks(layer);
  ASSERT_TRUE(tracks.ok()) << tracks.status();
  EXPECT_THAT(*tracks, ::testing::UnorderedElementsAreArray(
                           std::vector<TrackId>(tracks_.begin(), tracks_.end())));
  ExpectSameNames(rng, log, layer);
  ExpectSameNewest(log, layer);
  ExpectSameEntries(rng, log, layer);
  ExpectSameCheckpoints(rng, log, layer);
}

void EvidenceModel::ExpectSameNames(Rng& rng, FusionLog& log, const std::string& layer) const {
  for (const std::string robot : kRobots) {
    SCOPED_TRACE(robot);
    std::vector<SequenceRange> sequences;
    for (int64_t sequence = -20; sequence <= 60; ++sequence) {
      const Name name(robot, sequence);
      if (observations_.contains(name) || forgotten_.contains(name)) {
        AppendSequence(sequence, &sequences);
      }
    }
    const auto stored_sequences = log.Sequences(layer, robot);
    ASSERT_TRUE(stored_sequences.ok()) << stored_sequences.status();
    EXPECT_EQ(*stored_sequences, sequences);

    const Name name(robot, UniformInt(rng, -22, 62));
    const auto known = log.FindObservation(layer, name.first, name.second);
    ASSERT_TRUE(known.ok()) << known.status();
    const auto stored = observations_.find(name);
    ASSERT_EQ(known->has_value(), stored != observations_.end() || forgotten_.contains(name));
    if (stored == observations_.end() || IsForgotten({stored->second.observation.key, 0})) continue;
    EXPECT_EQ((*known)->content_hash, stored->second.observation.content_hash);
    EXPECT_EQ((*known)->retracted, stored->second.retracted);
  }
}

void EvidenceModel::ExpectSameNewest(FusionLog& log, const std::string& layer) const {
  std::optional<ObservationKey> newest;
  std::optional<LogKey> newest_fact;
  for (const LogEntry& entry : Entries()) {
    if (entry.key.number == 0) newest = entry.key.after;
    if (entry.key.number > 0) newest_fact = entry.key;
  }
  const auto key = log.NewestKey(layer);
  ASSERT_TRUE(key.ok()) << key.status();
  if (newest || is_settled()) {
    EXPECT_EQ(*key, newest);
  }
  const auto fact = log.NewestFact(layer);
  ASSERT_TRUE(fact.ok()) << fact.status();
  if (newest_fact || is_settled()) {
    EXPECT_EQ(*fact, newest_fact);
  }
  for (const std::string robot : kRobots) {
    const auto keys = KeysOf(robot, absl::InfinitePast(), absl::InfiniteFuture());
    const auto stamp = log.NewestStamp(layer, robot);
    ASSERT_TRUE(stamp.ok()) << stamp.status();
    if (!keys.empty()) {
      EXPECT_EQ(*stamp, keys.back().stamp);
    }
    if (keys.empty() && is_settled()) {
      EXPECT_EQ(*stamp, std::nullopt);
    }
  }
}

void EvidenceModel::ExpectSameEntries(Rng& rng, FusionLog& log, const std::string& layer) const {
  const LogKey first = is_settled() ? BeforeAll() : base_->key;
  const LogKey after = std::max(first, UniformInt(rng, 0, 1) == 0 ? first : RandomKey(rng));
  std::vector<LogEntry> entries = Entries();
  const auto is_before = [&](const LogEntry& entry) { return entry.key <= after; };
  entries.erase(std::remove_if(entries.begin(), entries.end(), is_before), entries.end());
  std::vector<LogEntry> read;
  const int page = UniformInt(rng, 1, 12);
  for (LogKey next = after;;) {
    const auto part = log.Read(layer, next, page);
    ASSERT_TRUE(part.ok()) << part.status();
    ASSERT_LE(part->size(), static_cast<size_t>(page));
    if (part->empty()) break;
    ASSERT_GT(part->front().key, next);
    read.insert(read.end(), part->begin(), part->end());
    next = part->back().key;
  }
  ASSERT_EQ(read.size(), entries.size());
  for (size_t i = 0; i < read.size(); ++i) EXPECT_TRUE(read[i] == entries[i]) << "entry " << i;

  const std::string robot = RandomRobot(rng);
  const absl::Time from =
      std::max(first.after.stamp + absl::Nanoseconds(1), RandomKey(rng).after.stamp);
  const absl::Time to = from + absl::Nanoseconds(UniformInt(rng, 0, 200));
  const auto keys = log.KeysOf(layer, robot, from, to);
  ASSERT_TRUE(keys.ok()) << keys.status();
  EXPECT_EQ(*keys, KeysOf(robot, from, to));
}

void EvidenceModel::ExpectSameCheckpoints(Rng& rng, FusionLog& log,
                                          const std::string& layer) const {
  const auto keys = log.Checkpoints(layer);
  ASSERT_TRUE(keys.ok()) << keys.status();
  ASSERT_EQ(keys->size(), checkpoints_.size());
  auto expected = checkpoints_.begin();
  for (const FusionLog::CheckpointKey& key : *keys) {
    EXPECT_EQ(key.key, expected->first);
    EXPECT_EQ(key.stored_at, expected->second.stored_at);
    ++expected;
  }
  const auto newest_before = [&](auto end) -> std::optional<FusionCheckpoint> {
    if (end == checkpoints_.begin()) return std::nullopt;
    return std::prev(end)->second;
  };
  const LogKey before = RandomKey(rng);
  ExpectCheckpoint(log.FindCheckpoint(layer, std::nullopt), newest_before(checkpoints_.end()));
  ExpectCheckpoint(log.FindCheckpoint(layer, before),
                   newest_before(checkpoints_.lower_bound(before)));
  const absl::Time stored_before = absl::FromUnixNanos(UniformInt(rng, 0, 101));
  ExpectCheckpoint(log.FindNextBase(layer, stored_before), NextBase(stored_before));

  const auto base = log.FindBase(layer);
  ASSERT_TRUE(base.ok()) << base.status();
  ASSERT_EQ(base->has_value(), base_.has_value());
  if (base_) {
    EXPECT_EQ((*base)->key, base_->key);
    EXPECT_EQ((*base)->num_facts, base_->num_facts);
    EXPECT_EQ((*base)->state, base_->state);
  }
  for (const std::string robot : kRobots) {
    const auto has_forgotten = log.HasForgotten(layer, robot);
    ASSERT_TRUE(has_forgotten.ok()) << has_forgotten.status();
    const auto is_forgotten = [&](const auto& named) {
      return named.first.first == robot && IsForgotten({named.second.observation.key, 0});
    };
    const bool expected_forgotten =
        std::any_of(observations_.begin(), observations_.end(), is_forgotten) ||
        std::any_of(forgotten_.begin(), forgotten_.end(),
                    [&](const Name& name) { return name.first == robot; });
    EXPECT_EQ(*has_forgotten, expected_forgotten) << robot;
  }
}

}  // namespace hypermap::storage
