#include "wire/ingest.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "wire/enum_names.h"
#include "wire/time.h"

namespace hypermap::wire {
namespace {

constexpr EnumNames<ObservationOutcome, v1::ObservationOutcome, 5> kObservationOutcomes{{
    {ObservationOutcome::kAccepted, v1::OBSERVATION_OUTCOME_ACCEPTED},
    {ObservationOutcome::kDuplicate, v1::OBSERVATION_OUTCOME_DUPLICATE},
    {ObservationOutcome::kRefusedLate, v1::OBSERVATION_OUTCOME_REFUSED_LATE},
    {ObservationOutcome::kInvalid, v1::OBSERVATION_OUTCOME_INVALID},
    {ObservationOutcome::kConflict, v1::OBSERVATION_OUTCOME_CONFLICT},
}};

constexpr EnumNames<ObjectEventKind, v1::ObjectEventKind, 6> kEventKinds{{
    {ObjectEventKind::kFounded, v1::OBJECT_EVENT_KIND_FOUNDED},
    {ObjectEventKind::kSeen, v1::OBJECT_EVENT_KIND_SEEN},
    {ObjectEventKind::kMissed, v1::OBJECT_EVENT_KIND_MISSED},
    {ObjectEventKind::kMerged, v1::OBJECT_EVENT_KIND_MERGED},
    {ObjectEventKind::kPinned, v1::OBJECT_EVENT_KIND_PINNED},
    {ObjectEventKind::kRemoved, v1::OBJECT_EVENT_KIND_REMOVED},
}};

void EncodeEvent(const ObjectEvent& event, v1::ObjectEvent* message) {
  message->set_kind(EncodeEnum(kEventKinds, event.kind));
  if (!event.at.robot.empty()) {
    message->set_robot(event.at.robot);
    message->set_sequence(event.at.sequence);
    EncodeTime(event.at.stamp, message->mutable_stamp());
  }
  message->set_detection(event.detection);
  message->set_score(event.score);
  if (event.existence) message->set_existence(*event.existence);
  message->set_track(event.track);
}

absl::StatusOr<ObjectEvent> DecodeEvent(absl::string_view field, const v1::ObjectEvent& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const ObjectEventKind kind,
                            DecodeEnum(kEventKinds, absl::StrCat(field, ".kind"), message.kind()));
  ObjectEvent event;
  event.kind = kind;
  event.at = {DecodeTime(message.stamp()), message.robot(), message.sequence()};
  event.detection = message.detection();
  event.score = message.score();
  if (message.has_existence()) event.existence = message.existence();
  event.track = message.track();
  return event;
}

}  // namespace

void EncodeVerdict(const ObservationVerdict& verdict, v1::ObservationAcknowledgement* message) {
  message->set_robot(verdict.robot);
  message->set_sequence(verdict.sequence);
  message->set_outcome(EncodeEnum(kObservationOutcomes, verdict.outcome));
  message->set_revision(verdict.revision);
  message->set_message(verdict.message);
  if (verdict.clock_skew_s) message->set_clock_skew_s(*verdict.clock_skew_s);
}

absl::StatusOr<ObservationVerdict> DecodeVerdict(const v1::ObservationAcknowledgement& message) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const ObservationOutcome outcome,
      DecodeEnum(kObservationOutcomes, "acknowledgement.outcome", message.outcome()));
  ObservationVerdict verdict{message.robot(), message.sequence(), outcome, message.revision(),
                             message.message()};
  if (message.has_clock_skew_s()) verdict.clock_skew_s = message.clock_skew_s();
  return verdict;
}

ObservationVerdict InvalidVerdict(const v1::Observation& observation, const absl::Status& why) {
  return {observation.robot(), observation.sequence(), ObservationOutcome::kInvalid, 0,
          std::string(why.message())};
}

void EncodeOpened(const OpenedLayer& opened, v1::ObserveOpened* message) {
  message->set_strategy(opened.strategy);
  message->set_parameters(opened.parameters);
  message->set_exploration_layer(opened.exploration_layer);
  message->set_incarnation(opened.incarnation);
  for (const SequenceRange& range : opened.known) {
    v1::SequenceRange* const encoded = message->add_known();
    encoded->set_first(range.first);
    encoded->set_last(range.last);
  }
}

OpenedLayer DecodeOpened(const v1::ObserveOpened& message) {
  OpenedLayer opened{message.strategy(),
                     message.parameters(),
                     message.exploration_layer(),
                     {},
                     message.incarnation()};
  for (const v1::SequenceRange& range : message.known()) {
    opened.known.push_back({range.first(), range.last()});
  }
  return opened;
}

void EncodeObjectHistory(const ObjectHistory& history, v1::ExplainObjectResponse* message) {
  message->set_map(history.map);
  message->set_revision(history.revision);
  message->set_object_id(history.object_id);
  message->set_strategy(history.strategy);
  message->set_parameters(history.parameters);
  message->set_track(history.track);
  message->set_incarnation(history.incarnation);
  if (history.forgotten_until) {
    EncodeTime(*history.forgotten_until, message->mutable_forgotten_until());
  }
  for (const ObjectEvent& event : history.events) EncodeEvent(event, message->add_events());
}

absl::StatusOr<ObjectHistory> DecodeObjectHistory(const v1::ExplainObjectResponse& message) {
  ObjectHistory history{message.map(),
                        message.revision(),
                        message.object_id(),
                        message.strategy(),
                        message.parameters(),
                        message.track(),
                        {},
                        message.incarnation()};
  if (message.has_forgotten_until()) {
    history.forgotten_until = DecodeTime(message.forgotten_until());
  }
  for (const v1::ObjectEvent& encoded : message.events()) {
    HYPERMAP_ASSIGN_OR_RETURN(
        ObjectEvent event,
        DecodeEvent(absl::StrCat("events[", history.events.size(), "]"), encoded));
    history.events.push_back(std::move(event));
  }
  return history;
}

}  // namespace hypermap::wire
