#include "wire/ingest.h"

#include <gtest/gtest.h>

#include <optional>

namespace hypermap::wire {
namespace {

TEST(VerdictOnTheWire, EveryOutcomeComesBack) {
  for (const ObservationOutcome outcome :
       {ObservationOutcome::kAccepted, ObservationOutcome::kDuplicate,
        ObservationOutcome::kRefusedLate, ObservationOutcome::kInvalid,
        ObservationOutcome::kConflict}) {
    const ObservationVerdict verdict{"cart", -3, outcome, 17, "is there already"};
    v1::ObservationAcknowledgement message;
    EncodeVerdict(verdict, &message);
    const auto decoded = DecodeVerdict(message);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, verdict);
  }
}

TEST(VerdictOnTheWire, C2ClockSkewComesBackAndZeroIsNotAbsence) {
  for (const std::optional<double> skew_s :
       {std::optional<double>(), std::optional(0.0), std::optional(-598.25)}) {
    const ObservationVerdict verdict{"cart", 3, ObservationOutcome::kAccepted, 17, "", skew_s};
    v1::ObservationAcknowledgement message;
    EncodeVerdict(verdict, &message);
    EXPECT_EQ(message.has_clock_skew_s(), skew_s.has_value());
    const auto decoded = DecodeVerdict(message);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, verdict);
  }
}

TEST(VerdictOnTheWire, MustHaveAKnownOutcome) {
  v1::ObservationAcknowledgement message;
  EXPECT_EQ(DecodeVerdict(message).status(),
            absl::InvalidArgumentError("acknowledgement.outcome is missing"));
  message.set_outcome(static_cast<v1::ObservationOutcome>(99));
  EXPECT_EQ(DecodeVerdict(message).status(),
            absl::InvalidArgumentError("acknowledgement.outcome is not known: 99"));
}

TEST(VerdictOnTheWire, OnAnObservationThatCannotBeDecodedNamesIt) {
  v1::Observation observation;
  observation.set_robot("cart");
  observation.set_sequence(5);
  const ObservationVerdict verdict =
      InvalidVerdict(observation, absl::InvalidArgumentError("stamp is not a time"));
  EXPECT_EQ(verdict, (ObservationVerdict{"cart", 5, ObservationOutcome::kInvalid, 0,
                                         "stamp is not a time"}));
}

TEST(OpenedLayerOnTheWire, ComesBack) {
  const OpenedLayer opened{"evidence", R"({"iou":0.5})", "explored", {{-2, 4}, {9, 9}}, 77};
  v1::ObserveOpened message;
  EncodeOpened(opened, &message);
  EXPECT_EQ(DecodeOpened(message), opened);
}

TEST(ObjectHistoryOnTheWire, ComesBack) {
  const ObservationKey at{absl::FromUnixMillis(1'700'000'000'250), "cart", 8};
  const ObjectHistory history{"office",
                              12,
                              34,
                              "evidence",
                              "{}",
                              "cart/7/0",
                              {{ObjectEventKind::kPinned, {}, 0, 0.0, std::nullopt, ""},
                               {ObjectEventKind::kFounded, at, 2, 1.0, 0.5, ""},
                               {ObjectEventKind::kSeen, at, 1, 0.25, 0.75, ""},
                               {ObjectEventKind::kMissed, at, 0, 0.0, 0.0, ""},
                               {ObjectEventKind::kMerged, at, 0, 0.0, 0.875, "cart/8/1"},
                               {ObjectEventKind::kRemoved, at, 0, 0.0, std::nullopt, ""}},
                              77,
                              absl::FromUnixSeconds(1'600'000'000)};
  v1::ExplainObjectResponse message;
  EncodeObjectHistory(history, &message);
  EXPECT_FALSE(message.events(0).has_stamp());
  const auto decoded = DecodeObjectHistory(message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, history);
  message.mutable_events(1)->clear_kind();
  EXPECT_EQ(DecodeObjectHistory(message).status(),
            absl::InvalidArgumentError("events[1].kind is missing"));
}

}  // namespace
}  // namespace hypermap::wire
