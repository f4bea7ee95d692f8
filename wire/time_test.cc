#include "wire/time.h"

#include <gtest/gtest.h>

namespace hypermap::wire {
namespace {

TEST(TimeOnTheWire, ComesBackToTheNanosecond) {
  for (const absl::Time time :
       {absl::UnixEpoch(), absl::FromUnixSeconds(1'700'000'000) + absl::Nanoseconds(123'456'789),
        absl::FromUnixSeconds(-5) + absl::Nanoseconds(1)}) {
    google::protobuf::Timestamp message;
    EncodeTime(time, &message);
    EXPECT_EQ(DecodeTime(message), time);
    EXPECT_GE(message.nanos(), 0);
  }
}

TEST(DurationOnTheWire, ComesBackEqualUpToAHundredYears) {
  for (const absl::Duration duration :
       {absl::ZeroDuration(), absl::Nanoseconds(1), absl::Seconds(90) + absl::Milliseconds(5),
        -absl::Milliseconds(1500), absl::Hours(24 * 365 * 99)}) {
    google::protobuf::Duration message;
    EncodeDuration(duration, &message);
    EXPECT_EQ(*DecodeDuration("d", message), duration);
  }
  google::protobuf::Duration message;
  message.set_seconds(int64_t{1} << 62);
  EXPECT_EQ(DecodeDuration("d", message).status(),
            absl::InvalidArgumentError("d is longer than 100 years"));
}

}  // namespace
}  // namespace hypermap::wire
