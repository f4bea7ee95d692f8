#include "map/exploration/exploration_objects.h"

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap {
namespace {

constexpr std::array<std::pair<ExplorationState, const char*>, 2> kStates{{
    {ExplorationState::kActive, "active"},
    {ExplorationState::kEnded, "ended"},
}};
constexpr std::array<std::pair<EndReason, const char*>, 4> kReasons{{
    {EndReason::kNone, ""},
    {EndReason::kDone, "done"},
    {EndReason::kOnlyUnreachableLeft, "only_unreachable_left"},
    {EndReason::kStopped, "stopped"},
}};

template <typename Enum, size_t kSize>
absl::string_view NameOf(const std::array<std::pair<Enum, const char*>, kSize>& names, Enum value) {
  for (const auto& [known, name] : names) {
    if (known == value) return name;
  }
  return "";
}

// Names of attributes.
constexpr char kState[] = "state";
constexpr char kEndReason[] = "end_reason";
constexpr char kOccupancyLayer[] = "occupancy_layer";
constexpr char kExplorationLayer[] = "exploration_layer";
constexpr char kRobotRadius[] = "robot_radius_m";
constexpr char kRange[] = "range_m";
constexpr char kMinGain[] = "min_gain_cells";
constexpr char kStarted[] = "started";
constexpr char kEnded[] = "ended";
constexpr char kExploration[] = "exploration";
constexpr char kRobot[] = "robot";
constexpr char kGain[] = "gain_cells";
constexpr char kPathLength[] = "path_length_m";
constexpr char kOccupancyVersion[] = "occupancy_version";

// Attributes have no type for times, so that they are stored as text.
std::string TimeText(absl::Time time) {
  return absl::FormatTime(absl::RFC3339_full, time, absl::UTCTimeZone());
}

// Reads an object's attributes. Keeps the first error, so that callers check once, at the end.
class AttributeReader {
 public:
  AttributeReader(const SemanticObject& object, absl::string_view label) : object_(object) {
    if (object.label != label) {
      status_ = absl::DataLossError(absl::StrCat("object ", object.id, " is no ", label));
    }
  }

  const absl::Status& status() const { return status_; }

  template <typename T>
  T Get(const char* name) {
    const auto it = object_.attributes.find(name);
    const T* value = it == object_.attributes.end() ? nullptr : std::get_if<T>(&it->second);
    if (value != nullptr) return *value;
    Fail(name);
    return T();
  }
  double GetNumber(const char* name) {
    // Editors that store numbers as text may have turned 4.0 into an integer.
    const auto it = object_.attributes.find(name);
    if (it != object_.attributes.end() && std::holds_alternative<int64_t>(it->second)) {
      return static_cast<double>(std::get<int64_t>(it->second));
    }
    return Get<double>(name);
  }
  absl::Time GetTime(const char* name) {
    const auto text = Get<std::string>(name);
    absl::Time time;
    std::string error;
    if (!absl::ParseTime(absl::RFC3339_full, text, &time, &error)) Fail(name);
    return time;
  }
  template <typename Enum, size_t kSize>
  Enum GetEnum(const char* name, const std::array<std::pair<Enum, const char*>, kSize>& names) {
    const auto text = Get<std::string>(name);
    for (const auto& [value, known] : names) {
      if (known == text) return value;
    }
    Fail(name);
    return names.front().first;
  }
  bool Has(const char* name) const { return object_.attributes.contains(name); }
  // Records an error for the attribute if `holds` is false.
  void Expect(bool holds, const char* name) {
    if (!holds) Fail(name);
  }

  // Returns the object's shape; empty, with an error, if it is not a polygon.
  Polygon GetPolygon() {
    if (object_.shape.is_polygon()) return object_.shape.polygon();
    status_.Update(absl::DataLossError(
        absl::StrCat(object_.label, " ", object_.id, ": its shape is no polygon")));
    return {};
  }

 private:
  void Fail(const char* name) {
    status_.Update(absl::DataLossError(absl::StrCat(object_.label, " ", object_.id, ": attribute ",
                                                    name, " is missing or not what it was")));
  }

  const SemanticObject& object_;
  absl::Status status_;
};

SemanticObject MakeObject(ObjectId id, const char* label, const Polygon& polygon) {
  SemanticObject object;
  object.id = id;
  object.label = label;
  object.shape = polygon;
  return object;
}

// The newest first.
using Explorations = std::map<ObjectId, ExplorationObjects, std::greater<>>;

// Returns the explorations without their goals and unreachable places.
absl::StatusOr<Explorations> ReadWithoutParts(const std::vector<ObjectPtr>& objects) {
  Explorations found;
  for (const ObjectPtr& object : objects) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    if (object->label != kExplorationLabel) continue;
    HYPERMAP_ASSIGN_OR_RETURN(Exploration exploration, ToExploration(*object));
    found[object->id].exploration = std::move(exploration);
  }
  return found;
}

// Adds a goal or place to its exploration, if that is in `found` and has fewer than `most`.
template <typename Part>
void AddPart(Part part, std::vector<Part> ExplorationObjects::*parts, size_t most,
             Explorations* found) {
  const auto it = found->find(part.exploration_id);
  if (it == found->end() || (it->second.*parts).size() >= most) return;
  (it->second.*parts).push_back(std::move(part));
}

// Adds goals and unreachable places to their explorations in `found`. `objects` are sorted by id.
absl::Status AddParts(const std::vector<ObjectPtr>& objects, Explorations* found) {
  for (auto it = objects.rbegin(); it != objects.rend(); ++it) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const SemanticObject& object = **it;
    if (object.label == kGoalLabel) {
      HYPERMAP_ASSIGN_OR_RETURN(ExplorationGoal goal, ToGoal(object));
      AddPart(std::move(goal), &ExplorationObjects::goals, kMaxGoals, found);
    } else if (object.label == kUnreachableLabel) {
      HYPERMAP_ASSIGN_OR_RETURN(UnreachablePlace place, ToUnreachablePlace(object));
      AddPart(std::move(place), &ExplorationObjects::unreachable_places, kMaxUnreachablePlaces,
              found);
    }
  }
  for (auto& [id, exploration] : *found) {
    std::reverse(exploration.goals.begin(), exploration.goals.end());
    std::reverse(exploration.unreachable_places.begin(), exploration.unreachable_places.end());
  }
  return absl::OkStatus();
}

}  // namespace

absl::string_view ExplorationStateName(ExplorationState state) { return NameOf(kStates, state); }
absl::string_view EndReasonName(EndReason reason) { return NameOf(kReasons, reason); }

SemanticObject ToObject(const Exploration& exploration) {
  SemanticObject object = MakeObject(exploration.id, kExplorationLabel, exploration.area);
  Attributes& attributes = object.attributes;
  attributes[kState] = std::string(ExplorationStateName(exploration.state));
  attributes[kEndReason] = std::string(EndReasonName(exploration.end_reason));
  attributes[kOccupancyLayer] = exploration.occupancy_layer;
  attributes[kExplorationLayer] = exploration.exploration_layer;
  attributes[kRobotRadius] = exploration.robot_radius_m;
  attributes[kRange] = exploration.range_m;
  attributes[kMinGain] = exploration.min_gain_cells;
  attributes[kStarted] = TimeText(exploration.started);
  if (exploration.ended) attributes[kEnded] = TimeText(*exploration.ended);
  return object;
}

SemanticObject ToObject(const ExplorationGoal& goal) {
  SemanticObject object = MakeObject(goal.id, kGoalLabel, goal.cell);
  object.expires_at = goal.expires_at;
  object.attributes[kExploration] = goal.exploration_id;
  object.attributes[kRobot] = goal.robot;
  object.attributes[kGain] = goal.gain_cells;
  object.attributes[kPathLength] = goal.path_length_m;
  return object;
}

SemanticObject ToObject(const UnreachablePlace& place) {
  SemanticObject object = MakeObject(place.id, kUnreachableLabel, place.cell);
  object.attributes[kExploration] = place.exploration_id;
  object.attributes[kRobot] = place.robot;
  object.attributes[kOccupancyVersion] = place.occupancy_version;
  return object;
}

absl::StatusOr<Exploration> ToExploration(const SemanticObject& object) {
  AttributeReader reader(object, kExplorationLabel);
  Exploration exploration;
  exploration.id = object.id;
  exploration.area = reader.GetPolygon();
  exploration.state = reader.GetEnum(kState, kStates);
  exploration.end_reason = reader.GetEnum(kEndReason, kReasons);
  exploration.occupancy_layer = reader.Get<std::string>(kOccupancyLayer);
  exploration.exploration_layer = reader.Get<std::string>(kExplorationLayer);
  exploration.robot_radius_m = reader.GetNumber(kRobotRadius);
  exploration.range_m = reader.GetNumber(kRange);
  exploration.min_gain_cells = reader.Get<int64_t>(kMinGain);
  exploration.started = reader.GetTime(kStarted);
  if (reader.Has(kEnded)) exploration.ended = reader.GetTime(kEnded);
  reader.Expect(exploration.robot_radius_m >= 0 && exploration.robot_radius_m <= kMaxRobotRadius_m,
                kRobotRadius);
  reader.Expect(exploration.range_m > 0 && exploration.range_m <= kMaxRange_m, kRange);
  reader.Expect(exploration.min_gain_cells > 0, kMinGain);
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  return exploration;
}

absl::StatusOr<ExplorationGoal> ToGoal(const SemanticObject& object) {
  AttributeReader reader(object, kGoalLabel);
  ExplorationGoal goal;
  goal.id = object.id;
  goal.cell = reader.GetPolygon();
  goal.expires_at = object.expires_at;
  goal.exploration_id = reader.Get<int64_t>(kExploration);
  goal.robot = reader.Get<std::string>(kRobot);
  goal.gain_cells = reader.Get<int64_t>(kGain);
  goal.path_length_m = reader.GetNumber(kPathLength);
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  return goal;
}

absl::StatusOr<UnreachablePlace> ToUnreachablePlace(const SemanticObject& object) {
  AttributeReader reader(object, kUnreachableLabel);
  UnreachablePlace place;
  place.id = object.id;
  place.cell = reader.GetPolygon();
  place.exploration_id = reader.Get<int64_t>(kExploration);
  place.robot = reader.Get<std::string>(kRobot);
  place.occupancy_version = reader.Get<int64_t>(kOccupancyVersion);
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  return place;
}

absl::StatusOr<std::vector<ExplorationObjects>> ReadExplorations(const SemanticLayer& layer) {
  const std::vector<ObjectPtr> objects = layer.Objects();
  HYPERMAP_ASSIGN_OR_RETURN(Explorations found, ReadWithoutParts(objects));
  HYPERMAP_RETURN_IF_ERROR(AddParts(objects, &found));
  std::vector<ExplorationObjects> all;
  all.reserve(found.size());
  for (auto& [id, exploration] : found) all.push_back(std::move(exploration));
  return all;
}

absl::StatusOr<ExplorationObjects> FindExploration(const SemanticLayer& layer, ObjectId id) {
  const std::vector<ObjectPtr> objects = layer.Objects();
  HYPERMAP_ASSIGN_OR_RETURN(Explorations all, ReadWithoutParts(objects));
  const auto it = id == 0 ? all.begin() : all.find(id);
  if (it == all.end()) {
    return absl::NotFoundError(id == 0 ? "there is no exploration"
                                       : absl::StrCat("there is no exploration ", id));
  }
  Explorations found;
  found.insert(all.extract(it));
  HYPERMAP_RETURN_IF_ERROR(AddParts(objects, &found));
  return std::move(found.begin()->second);
}

}  // namespace hypermap
