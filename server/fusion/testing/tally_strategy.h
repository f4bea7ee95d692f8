// A strategy with predictable results, for tests: one track for each class, founded by its first
// detection. It shows the hull of the newest detection, and a digest of all as an attribute, which
// depends on their order.
#ifndef HYPERMAP_SERVER_FUSION_TESTING_TALLY_STRATEGY_H_
#define HYPERMAP_SERVER_FUSION_TESTING_TALLY_STRATEGY_H_

#include <map>
#include <memory>
#include <new>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status/status_macros.h"
#include "map/fusion/strategy.h"
#include "wire/observation.h"

namespace hypermap::server {

class TallyStrategy : public fusion::Strategy {
 public:
  explicit TallyStrategy(std::string name) : name_(std::move(name)) {}

  // Bytes that a track counts as.
  static constexpr int64_t kBytesOfTrack = 1000;
  // The label of a detection for which memory fails.
  static constexpr char kNoMemory[] = "no memory";

  struct Track {
    fusion::TrackKey key;
    ObjectPtr object;
    bool pinned = false;
  };
  struct State : fusion::State {
    std::map<std::string, Track> by_label;
    std::set<std::string> removed;
  };

  absl::string_view name() const override { return name_; }
  int64_t ByteSize(const fusion::StatePtr& state, const fusion::StatePtr& older) const override {
    if (state == older) return 0;
    return kBytesOfTrack * static_cast<int64_t>(static_cast<const State&>(*state).by_label.size());
  }
  int64_t MostGrowth(const Observation& observation) const override {
    return kBytesOfTrack * static_cast<int64_t>(observation.detections.size());
  }
  fusion::StatePtr Initial() const override { return std::make_shared<State>(); }

  fusion::StatePtr Fold(const fusion::StatePtr& state, const Observation& observation,
                        fusion::FoldReport* report) const override {
    auto next = std::make_shared<State>(static_cast<const State&>(*state));
    for (size_t i = 0; i < observation.detections.size(); ++i) {
      const Detection& detection = observation.detections[i];
      const std::string label = detection.scores.begin()->first;
      if (label == kNoMemory) throw std::bad_alloc();
      if (next->removed.count(label) > 0) continue;
      Track& track = next->by_label[label];
      if (track.pinned) continue;
      auto object = std::make_shared<SemanticObject>();
      if (track.object) *object = *track.object;
      if (track.key.empty()) {
        track.key = absl::StrCat(observation.robot, "/", observation.sequence, "/", i);
      }
      object->label = label;
      object->shape = detection.hull;
      object->existence = name_ == "other" ? 0.5 : 1.0;
      // A digest of all detections so far that depends on their order.
      const auto before = object->attributes.find("digest");
      const int64_t digest =
          before == object->attributes.end() ? 7 : std::get<int64_t>(before->second);
      object->attributes["digest"] =
          (digest * 31 + observation.sequence + 1 + 100 * (observation.robot.back() - 'a')) %
          1'000'000'007;
      track.object = std::move(object);
      if (report != nullptr) {
        report->associations.push_back({static_cast<int>(i), track.key, 1.0});
        report->existence[track.key] = track.object->existence;
      }
    }
    return next;
  }

  class Facts : public fusion::FactFold {
   public:
    explicit Facts(const State& before) : after_(std::make_shared<State>(before)) {}

    void Add(const fusion::OperatorFact& fact) override {
      const std::string& label = fact.object.label;
      std::erase_if(after_->by_label, [&](const auto& other) {
        return other.second.key == fact.track && other.first != label;
      });
      if (fact.kind == fusion::OperatorFact::Kind::kRemove) {
        after_->by_label.erase(label);
        after_->removed.insert(label);
        return;
      }
      Track& track = after_->by_label[label];
      // The pin takes over the track of its label.
      if (track.key.empty()) track.key = fact.track;
      track.object = std::make_shared<SemanticObject>(fact.object);
      track.pinned = true;
      after_->removed.erase(label);
    }
    fusion::StatePtr Finish() override { return std::move(after_); }

   private:
    std::shared_ptr<State> after_;
  };

  std::unique_ptr<fusion::FactFold> FoldFacts(const fusion::StatePtr& state) const override {
    return std::make_unique<Facts>(static_cast<const State&>(*state));
  }

  std::vector<fusion::FusedObject> Objects(const fusion::StatePtr& state) const override {
    std::map<fusion::TrackKey, ObjectPtr> sorted;
    for (const auto& [label, track] : static_cast<const State&>(*state).by_label) {
      sorted[track.key] = track.object;
    }
    std::vector<fusion::FusedObject> objects;
    objects.reserve(sorted.size());
    for (const auto& [key, object] : sorted) objects.push_back({key, object});
    return objects;
  }

  std::string Encode(const fusion::StatePtr& state) const override {
    const auto& tally = static_cast<const State&>(*state);
    std::string bytes;
    for (const auto& [label, track] : tally.by_label) {
      const std::string object = wire::ObjectToBytes(*track.object);
      absl::StrAppend(&bytes, "t\n", label, "\n", track.key, "\n", track.pinned ? 1 : 0, "\n",
                      object.size(), "\n", object);
    }
    for (const std::string& label : tally.removed) absl::StrAppend(&bytes, "r\n", label, "\n");
    return bytes;
  }

  absl::StatusOr<fusion::StatePtr> Decode(absl::string_view bytes) const override {
    auto state = std::make_shared<State>();
    const auto line = [&bytes] {
      const size_t end = std::min(bytes.find('\n'), bytes.size() - 1);
      std::string text(bytes.substr(0, end));
      bytes.remove_prefix(end + 1);
      return text;
    };
    while (!bytes.empty()) {
      const std::string kind = line();
      const std::string label = line();
      if (kind == "r") {
        state->removed.insert(label);
        continue;
      }
      Track& track = state->by_label[label];
      track.key = line();
      track.pinned = line() == "1";
      const size_t size = std::stoul(line());
      auto object = wire::ObjectFromBytes(bytes.substr(0, size));
      HYPERMAP_RETURN_IF_ERROR(object.status());
      track.object = std::make_shared<SemanticObject>(*std::move(object));
      bytes.remove_prefix(size);
    }
    return state;
  }

 private:
  const std::string name_;
};

// Makes the strategies "tally" and "other", whose objects differ in their existence.
inline absl::StatusOr<std::unique_ptr<fusion::Strategy>> MakeTallyStrategy(
    absl::string_view name, absl::string_view parameters) {
  if (name != "tally" && name != "other") {
    return absl::InvalidArgumentError(absl::StrCat("there is no strategy \"", name, "\""));
  }
  if (!parameters.empty() && parameters != "{}") {
    return absl::InvalidArgumentError("parameters: there are none");
  }
  return std::make_unique<TallyStrategy>(std::string(name));
}

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_TESTING_TALLY_STRATEGY_H_
