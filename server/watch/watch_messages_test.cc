#include "server/watch/watch_messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "google/protobuf/descriptor.h"

namespace hypermap::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

std::string Bytes(const grpc::Slice& slice) { return {slice.begin(), slice.end()}; }

// WatchMessage relies on this.
TEST(WatchMessagesTest, FieldsOfWatchResponseAreTheSameInReplicateResponse) {
  const Descriptor& watch = *v1::WatchResponse::descriptor();
  const Descriptor& replicate = *v1::ReplicateResponse::descriptor();
  ASSERT_GT(watch.field_count(), 0);
  for (int i = 0; i < watch.field_count(); ++i) {
    const FieldDescriptor& field = *watch.field(i);
    const FieldDescriptor* const twin = replicate.FindFieldByNumber(field.number());
    ASSERT_NE(twin, nullptr) << field.name();
    EXPECT_EQ(field.name(), twin->name());
    EXPECT_EQ(field.type(), twin->type()) << field.name();
    EXPECT_EQ(field.label(), twin->label()) << field.name();
    if (field.message_type() == &watch) {
      EXPECT_EQ(twin->message_type(), &replicate) << field.name();
    } else {
      EXPECT_EQ(field.message_type(), twin->message_type()) << field.name();
    }
  }
}

// The messages of two commits, coalesced.
grpc::Slice TwoCommits() {
  std::vector<grpc::Slice> messages;
  for (const Revision revision : {7, 8}) {
    FeedCommit commit;
    commit.revision = revision;
    commit.time = absl::FromUnixSeconds(60);
    commit.author = "cart";
    WatchMessage message = MessageOf(commit, /*incarnation=*/5);
    MapChange change;
    change.kind = ChangeKind::kRemove;
    change.layer = "objects";
    change.object_id = 4;
    EXPECT_EQ(EncodeChanges({change}, 0, {}, message.mutable_changes()), 1u);
    messages.push_back(grpc::Slice(message.SerializeAsString()));
  }
  return Coalesce(messages);
}

TEST(WatchMessagesTest, BytesAreAMessageOfBothRpcs) {
  const std::string bytes = Bytes(TwoCommits());
  v1::WatchResponse watched;
  v1::ReplicateResponse replicated;
  ASSERT_TRUE(watched.ParseFromString(bytes));
  ASSERT_TRUE(replicated.ParseFromString(bytes));
  EXPECT_EQ(watched.ShortDebugString(), replicated.ShortDebugString());
  EXPECT_EQ(watched.SerializeAsString(), bytes);
  ASSERT_EQ(watched.coalesced_size(), 2);
  EXPECT_EQ(watched.coalesced(1).revision(), 8);
  EXPECT_EQ(watched.coalesced(1).incarnation(), 5);
  EXPECT_EQ(watched.coalesced(1).author(), "cart");
  EXPECT_EQ(watched.coalesced(1).time().seconds(), 60);
  EXPECT_EQ(watched.coalesced(1).changes(0).object_id(), 4);
}

TEST(WatchMessagesTest, ASingleMessageIsNotWrapped) {
  const grpc::Slice message(std::string("as it is"));
  EXPECT_EQ(Bytes(Coalesce({message})), "as it is");
  EXPECT_EQ(Coalesce({}).size(), 0u);
}

}  // namespace
}  // namespace hypermap::server
