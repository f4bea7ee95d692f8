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

}  // namespace
}  // namespace hypermap::wire
