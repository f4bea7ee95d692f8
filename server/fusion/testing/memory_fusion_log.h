// A FusionLog in memory, for tests.
#ifndef HYPERMAP_SERVER_FUSION_TESTING_MEMORY_FUSION_LOG_H_
#define HYPERMAP_SERVER_FUSION_TESTING_MEMORY_FUSION_LOG_H_

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "storage/fusion_log.h"

namespace hypermap::server {

// Keeps all checkpoints. Not thread safe.
class MemoryFusionLog : public storage::FusionLog {
 public:
  void Apply(const storage::FusionChange& change) {
    Layer& layer = layers_[change.layer];
    if (change.settings) layer.settings = *change.settings;
    if (change.stale_from) {
      layer.checkpoints.erase(layer.checkpoints.lower_bound(*change.stale_from),
                              layer.checkpoints.end());
    }
    for (const auto& o : change.observations) {
      layer.observations[{o.key.robot, o.key.sequence}] = o;
    }
    for (const auto& key : change.retracted) layer.retracted.insert(key);
    for (const auto& fact : change.facts) layer.facts[fact.key] = fact;
    for (const auto& [track, id] : change.tracks) layer.tracks[track] = id;
    if (change.base) layer.base = *change.base;
    for (const auto& [robot, sequences] : change.forgotten) {
      for (int64_t s = sequences.first; s <= sequences.last; ++s)
        layer.forgotten.insert({robot, s});
    }
  }
  void DropAll() { layers_.clear(); }
  void Drop(const std::string& layer) { layers_.erase(layer); }

  absl::StatusOr<std::vector<std::pair<std::string, storage::FusionSettings>>> FusedLayers()
      override {
    std::vector<std::pair<std::string, storage::FusionSettings>> layers;
    for (const auto& [name, layer] : layers_) {
      if (layer.settings) layers.emplace_back(name, *layer.settings);
    }
    return layers;
  }
  absl::StatusOr<std::vector<storage::TrackId>> Tracks(const std::string& layer) override {
    const auto& tracks = layers_[layer].tracks;
    return std::vector<storage::TrackId>(tracks.begin(), tracks.end());
  }
  absl::StatusOr<std::optional<Known>> FindObservation(const std::string& layer,
                                                       const std::string& robot,
                                                       int64_t sequence) override {
    const auto& observations = layers_[layer].observations;
    const auto it = observations.find({robot, sequence});
    if (it == observations.end()) {
      if (layers_[layer].forgotten.count({robot, sequence}) > 0) return Known();
      return std::nullopt;
    }
    return Known{it->second.content_hash, layers_[layer].retracted.count(it->second.key) > 0};
  }
  absl::StatusOr<std::vector<SequenceRange>> Sequences(const std::string& layer,
                                                       const std::string& robot) override {
    std::set<Name> names = layers_[layer].forgotten;
    for (const auto& [name, o] : layers_[layer].observations) names.insert(name);
    std::vector<SequenceRange> sequences;
    for (const auto& [of_robot, sequence] : names) {
      if (of_robot == robot) AppendSequence(sequence, &sequences);
    }
    return sequences;
  }
  absl::StatusOr<std::vector<ObservationKey>> KeysOf(const std::string& layer,
                                                     const std::string& robot, absl::Time from,
                                                     absl::Time to) override {
    std::vector<ObservationKey> keys;
    for (const auto& [key, entry] : Entries(layer)) {
      const ObservationKey& name = key.after;
      if (key.number == 0 && name.robot == robot && name.stamp >= from && name.stamp < to) {
        keys.push_back(name);
      }
    }
    return keys;
  }
  absl::StatusOr<std::optional<absl::Time>> NewestStamp(const std::string& layer,
                                                        const std::string& robot) override {
    std::optional<absl::Time> newest;
    for (const auto& [key, entry] : Entries(layer)) {
      if (key.number == 0 && key.after.robot == robot) newest = key.after.stamp;
    }
    return newest;
  }
  absl::StatusOr<std::optional<ObservationKey>> NewestKey(const std::string& layer) override {
    std::optional<ObservationKey> newest;
    for (const auto& [key, entry] : Entries(layer)) {
      if (key.number == 0) newest = key.after;
    }
    return newest;
  }
  absl::StatusOr<std::optional<storage::LogKey>> NewestFact(const std::string& layer) override {
    const auto& facts = layers_[layer].facts;
    if (facts.empty()) return std::nullopt;
    return facts.rbegin()->first;
  }
  absl::StatusOr<std::vector<storage::LogEntry>> FactsOfKind(const std::string& layer,
                                                             const std::string& kind) override {
    std::vector<storage::LogEntry> facts;
    for (const auto& [key, entry] : Entries(layer)) {
      if (key.number > 0 && entry.kind == kind) facts.push_back(entry);
    }
    return facts;
  }
  absl::StatusOr<std::vector<storage::LogEntry>> Read(const std::string& layer,
                                                      const storage::LogKey& after,
                                                      int max_entries) override {
    std::vector<storage::LogEntry> read;
    const auto entries = Entries(layer);
    for (auto it = entries.upper_bound(after);
         it != entries.end() && static_cast<int>(read.size()) < max_entries; ++it) {
      read.push_back(it->second);
    }
    return read;
  }
  absl::StatusOr<std::vector<StoredEntry>> ReadStored(const std::string& name,
                                                      const storage::LogKey& after,
                                                      int max_entries) override {
    const Layer& layer = layers_[name];
    std::map<storage::LogKey, StoredEntry> stored;
    for (const auto& [unused, o] : layer.observations) {
      const storage::LogKey key{o.key, 0};
      stored[key] = {
          {key, "", "", o.body}, o.content_hash, o.received_at, layer.retracted.count(o.key) > 0};
    }
    for (const auto& [key, fact] : layer.facts) {
      stored[key].entry = {key, fact.kind, fact.track, fact.body};
    }
    std::vector<StoredEntry> read;
    for (auto it = stored.upper_bound(after);
         it != stored.end() && static_cast<int>(read.size()) < max_entries; ++it) {
      read.push_back(it->second);
    }
    return read;
  }
  absl::StatusOr<std::vector<storage::ForgottenNames>> Forgotten(
      const std::string& layer, const std::optional<storage::ForgottenNames>& after,
      int max_count) override {
    std::map<std::string, std::vector<SequenceRange>> by_robot;
    for (const auto& [robot, sequence] : layers_[layer].forgotten) {
      AppendSequence(sequence, &by_robot[robot]);
    }
    std::vector<storage::ForgottenNames> names;
    for (const auto& [robot, ranges] : by_robot) {
      for (const SequenceRange& range : ranges) {
        const bool is_after = !after || std::pair(after->robot, after->sequences.first) <
                                            std::pair(robot, range.first);
        if (is_after && static_cast<int>(names.size()) < max_count) names.push_back({robot, range});
      }
    }
    return names;
  }
  absl::StatusOr<std::optional<storage::FusionCheckpoint>> FindCheckpoint(
      const std::string& layer, const std::optional<storage::LogKey>& before) override {
    const auto& checkpoints = layers_[layer].checkpoints;
    auto it = before ? checkpoints.lower_bound(*before) : checkpoints.end();
    if (it == checkpoints.begin()) return std::nullopt;
    return std::prev(it)->second;
  }
  absl::StatusOr<std::vector<CheckpointKey>> Checkpoints(const std::string& layer) override {
    std::vector<CheckpointKey> keys;
    for (const auto& [key, checkpoint] : layers_[layer].checkpoints) {
      keys.push_back({key, checkpoint.stored_at});
    }
    return keys;
  }
  absl::Status KeepCheckpoint(const std::string& layer, const storage::FusionCheckpoint& checkpoint,
                              absl::Span<const storage::LogKey> dropped) override {
    auto& checkpoints = layers_[layer].checkpoints;
    checkpoints[checkpoint.key] = checkpoint;
    for (const storage::LogKey& key : dropped) checkpoints.erase(key);
    return absl::OkStatus();
  }
  absl::StatusOr<std::optional<storage::FusionBase>> FindBase(const std::string& layer) override {
    return layers_[layer].base;
  }
  absl::StatusOr<bool> HasForgotten(const std::string& layer, const std::string& robot) override {
    const auto is_of_robot = [&](const Name& name) { return name.first == robot; };
    const std::set<Name>& forgotten = layers_[layer].forgotten;
    return std::any_of(forgotten.begin(), forgotten.end(), is_of_robot);
  }
  absl::StatusOr<std::optional<storage::FusionCheckpoint>> FindNextBase(
      const std::string& name, absl::Time stored_before) override {
    const Layer& layer = layers_[name];
    std::optional<storage::FusionCheckpoint> found;
    for (const auto& [key, checkpoint] : layer.checkpoints) {
      const bool is_new = !layer.base || layer.base->key < key;
      if (is_new && storage::BeforeAll().after < key.after &&
          checkpoint.stored_at < stored_before) {
        found = checkpoint;
      }
    }
    return found;
  }
  // Removes the forgotten entries at once.
  absl::Status MoveBase(const std::string& name, const storage::LogKey& key) override {
    Layer& layer = layers_[name];
    const auto checkpoint = layer.checkpoints.find(key);
    if (checkpoint == layer.checkpoints.end()) return absl::InternalError("no such checkpoint");
    const std::string state = checkpoint->second.state;
    int64_t num_facts = layer.base ? layer.base->num_facts : 0;
    while (!layer.facts.empty() && layer.facts.begin()->first <= key) {
      num_facts = layer.facts.begin()->first.number;
      layer.facts.erase(layer.facts.begin());
    }
    for (auto it = layer.observations.begin(); it != layer.observations.end();) {
      const bool is_forgotten = storage::LogKey{it->second.key, 0} <= key;
      if (is_forgotten) layer.forgotten.insert(it->first);
      it = is_forgotten ? layer.observations.erase(it) : std::next(it);
    }
    layer.checkpoints.erase(layer.checkpoints.begin(), layer.checkpoints.upper_bound(key));
    layer.base = storage::FusionBase{key, num_facts, state};
    return absl::OkStatus();
  }

  int NumCheckpoints(const std::string& layer) {
    return static_cast<int>(layers_[layer].checkpoints.size());
  }

 private:
  using Name = std::pair<std::string, int64_t>;  // robot, sequence
  struct Layer {
    // Absent until the first change of the layer: a reader may ask for a layer that is not there.
    std::optional<storage::FusionSettings> settings;
    std::map<Name, storage::LoggedObservation> observations;
    std::set<Name> forgotten;
    std::set<ObservationKey> retracted;
    std::map<storage::LogKey, storage::LoggedFact> facts;
    std::map<std::string, ObjectId> tracks;
    std::map<storage::LogKey, storage::FusionCheckpoint> checkpoints;
    std::optional<storage::FusionBase> base;
  };

  std::map<storage::LogKey, storage::LogEntry> Entries(const std::string& name) {
    const Layer& layer = layers_[name];
    std::map<storage::LogKey, storage::LogEntry> entries;
    for (const auto& [unused, o] : layer.observations) {
      if (layer.retracted.count(o.key) > 0) continue;
      entries[{o.key, 0}] = {{o.key, 0}, "", "", o.body};
    }
    for (const auto& [key, fact] : layer.facts) {
      entries[key] = {key, fact.kind, fact.track, fact.body};
    }
    return entries;
  }

  std::map<std::string, Layer> layers_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_TESTING_MEMORY_FUSION_LOG_H_
