#include "wire/status.h"

#include <gtest/gtest.h>

#include <string>

namespace hypermap::wire {
namespace {

TEST(StatusOnTheWire, EveryCodeComesBackWithItsMessage) {
  for (int code = 1; code <= 16; ++code) {
    const absl::Status status(static_cast<absl::StatusCode>(code), "layer x does not exist");
    EXPECT_EQ(DecodeStatus(EncodeStatus(status)), status);
  }
  EXPECT_TRUE(DecodeStatus(EncodeStatus(absl::OkStatus())).ok());
}

TEST(StatusOnTheWire, CodesMeanTheSameOnBothSides) {
  EXPECT_EQ(EncodeStatus(absl::NotFoundError("")).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(EncodeStatus(absl::DataLossError("")).error_code(), grpc::StatusCode::DATA_LOSS);
  EXPECT_EQ(EncodeStatus(absl::AbortedError("")).error_code(), grpc::StatusCode::ABORTED);
  EXPECT_EQ(EncodeStatus(absl::ResourceExhaustedError("")).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST(StatusOnTheWire, LongMessagesAreCutBetweenCharacters) {
  const std::string longest(2000, 'x');
  EXPECT_EQ(EncodeStatus(absl::NotFoundError(longest)).error_message(), longest);
  std::string euros = "x";
  for (int i = 0; i < 1000; ++i) euros += "€";
  EXPECT_EQ(EncodeStatus(absl::NotFoundError(euros)).error_message(),
            euros.substr(0, 1 + 3 * 666) + "... (3001 bytes)");
}

}  // namespace
}  // namespace hypermap::wire
