#include "wire/scope.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace hypermap::wire {
namespace {

TEST(ScopeTest, ComesBackEqual) {
  v1::Scope message;
  EncodeScope("site", {{"walls", "things"}, "dock"}, &message);
  EXPECT_EQ(message.map(), "site");
  const absl::StatusOr<Scope> scope = DecodeScope(message, Limits());
  ASSERT_TRUE(scope.ok()) << scope.status();
  EXPECT_EQ(scope->layers, (std::vector<std::string>{"walls", "things"}));
  EXPECT_EQ(scope->frame_id, "dock");
}

TEST(ScopeTest, HasNoMoreNamesThanAMapMayHaveLayers) {
  Limits limits;
  limits.max_layers = 2;
  v1::Scope message;
  message.add_layers("walls");
  message.add_layers("walls");
  EXPECT_TRUE(DecodeScope(message, limits).ok());
  message.add_layers("walls");
  EXPECT_EQ(DecodeScope(message, limits).status(),
            absl::ResourceExhaustedError("scope.layers has 3 entries, and --max_layers is 2"));
}

TEST(AsOfTest, ComesBackEqual) {
  const absl::Time time = absl::FromUnixSeconds(1'700'000'000) + absl::Nanoseconds(5);
  for (const AsOf& sent :
       {AsOf{}, AsOf{.revision = 0}, AsOf{.revision = 12, .min_revision = 9}, AsOf{.time = time},
        AsOf{.min_revision = 3}, AsOf{.seen_revision = 4, .seen_incarnation = 5},
        AsOf{.consistency = Consistency::kLinearizable}}) {
    v1::AsOf message;
    EncodeAsOf(sent, &message);
    const absl::StatusOr<AsOf> received = DecodeAsOf(message);
    ASSERT_TRUE(received.ok()) << received.status();
    EXPECT_EQ(received->revision, sent.revision);
    EXPECT_EQ(received->time, sent.time);
    EXPECT_EQ(received->min_revision, sent.min_revision);
    EXPECT_EQ(received->seen_revision, sent.seen_revision);
    EXPECT_EQ(received->seen_incarnation, sent.seen_incarnation);
    EXPECT_EQ(received->consistency, sent.consistency);
    EXPECT_EQ(received->is_past(), sent.is_past());
  }
}

TEST(AsOfTest, BadOnesNameTheField) {
  v1::AsOf message;
  message.set_at_revision(-1);
  EXPECT_EQ(DecodeAsOf(message).status(),
            absl::InvalidArgumentError("as_of.at_revision is negative"));
  message.mutable_at_time()->set_nanos(-1);
  EXPECT_EQ(DecodeAsOf(message).status(),
            absl::InvalidArgumentError("as_of.at_time is not a time"));
  message.mutable_at_time()->set_nanos(0);
  message.mutable_at_time()->set_seconds(int64_t{1} << 60);
  EXPECT_EQ(DecodeAsOf(message).status(),
            absl::InvalidArgumentError("as_of.at_time is not a time"));
  message.clear_at_time();
  message.set_min_revision(-1);
  EXPECT_EQ(DecodeAsOf(message).status(),
            absl::InvalidArgumentError("as_of.min_revision is negative"));
  message.clear_min_revision();
  message.set_consistency(static_cast<v1::Consistency>(77));
  EXPECT_EQ(DecodeAsOf(message).status(),
            absl::InvalidArgumentError("as_of.consistency is not known: 77"));
  message.set_consistency(v1::CONSISTENCY_LOCAL);
  EXPECT_TRUE(DecodeAsOf(message).ok());
}

}  // namespace
}  // namespace hypermap::wire
