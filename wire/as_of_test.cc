#include "wire/as_of.h"

#include <gtest/gtest.h>

#include "hypermap/v1/query_service.pb.h"

namespace hypermap::wire {
namespace {

template <typename Request>
class AsOfOnTheWire : public ::testing::Test {};
using Requests = ::testing::Types<v1::QueryPointRequest, v1::QueryAreaRequest,
                                  v1::QueryValueRequest, v1::QueryNearestRequest>;
TYPED_TEST_SUITE(AsOfOnTheWire, Requests);

TYPED_TEST(AsOfOnTheWire, ComesBackEqual) {
  const absl::Time time = absl::FromUnixSeconds(1'700'000'000) + absl::Nanoseconds(5);
  for (const AsOf& sent : {AsOf{}, AsOf{.revision = 0}, AsOf{.revision = 12, .min_revision = 9},
                           AsOf{.time = time}, AsOf{.min_revision = 3}}) {
    TypeParam request;
    EncodeAsOf(sent, &request);
    const absl::StatusOr<AsOf> received = DecodeAsOf(request);
    ASSERT_TRUE(received.ok()) << received.status();
    EXPECT_EQ(received->revision, sent.revision);
    EXPECT_EQ(received->time, sent.time);
    EXPECT_EQ(received->min_revision, sent.min_revision);
    EXPECT_EQ(received->is_past(), sent.is_past());
  }
}

TYPED_TEST(AsOfOnTheWire, BadOnesNameTheField) {
  TypeParam request;
  request.set_at_revision(-1);
  EXPECT_EQ(DecodeAsOf(request).status(), absl::InvalidArgumentError("at_revision is negative"));
  request.mutable_at_time()->set_nanos(-1);
  EXPECT_EQ(DecodeAsOf(request).status(), absl::InvalidArgumentError("at_time is not a time"));
  request.mutable_at_time()->set_nanos(0);
  request.mutable_at_time()->set_seconds(int64_t{1} << 60);
  EXPECT_EQ(DecodeAsOf(request).status(), absl::InvalidArgumentError("at_time is not a time"));
  request.clear_at_time();
  request.set_min_revision(-1);
  EXPECT_EQ(DecodeAsOf(request).status(), absl::InvalidArgumentError("min_revision is negative"));
}

}  // namespace
}  // namespace hypermap::wire
