#include "wire/time.h"

#include "wire/field.h"

namespace hypermap::wire {
namespace {

constexpr int32_t kNanosPerSecond = 1'000'000'000;
// The range of a Timestamp.
constexpr int64_t kYear1 = -62'135'596'800;
constexpr int64_t kYear10000 = 253'402'300'800;
constexpr int64_t kHundredYears = 3'155'760'000;

}  // namespace

void EncodeTime(absl::Time time, google::protobuf::Timestamp* message) {
  const int64_t seconds = absl::ToUnixSeconds(time);
  message->set_seconds(seconds);
  message->set_nanos(
      static_cast<int32_t>(absl::ToInt64Nanoseconds(time - absl::FromUnixSeconds(seconds))));
}

absl::Time DecodeTime(const google::protobuf::Timestamp& message) {
  return absl::FromUnixSeconds(message.seconds()) + absl::Nanoseconds(message.nanos());
}

absl::StatusOr<absl::Time> DecodeTime(absl::string_view field,
                                      const google::protobuf::Timestamp& message) {
  const bool valid = message.seconds() >= kYear1 && message.seconds() < kYear10000 &&
                     message.nanos() >= 0 && message.nanos() < kNanosPerSecond;
  if (!valid) return InvalidField(field, "is not a time");
  return DecodeTime(message);
}

void EncodeDuration(absl::Duration duration, google::protobuf::Duration* message) {
  message->set_seconds(absl::IDivDuration(duration, absl::Seconds(1), &duration));
  message->set_nanos(static_cast<int32_t>(absl::ToInt64Nanoseconds(duration)));
}

absl::StatusOr<absl::Duration> DecodeDuration(absl::string_view field,
                                              const google::protobuf::Duration& message) {
  const absl::Duration duration =
      absl::Seconds(message.seconds()) + absl::Nanoseconds(message.nanos());
  if (absl::AbsDuration(duration) > absl::Seconds(kHundredYears)) {
    return InvalidField(field, "is longer than 100 years");
  }
  return duration;
}

}  // namespace hypermap::wire
