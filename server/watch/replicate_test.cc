// The rpc Replicate.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <utility>
#include <vector>

#include "server/services/testing/test_server.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

// The map "site" with 12 cups, at revision 1.
class ReplicateTest : public ::testing::Test {
 protected:
  ReplicateTest() : server_({.chunk_items = 5, .watch_progress = absl::Milliseconds(20)}) {
    server_.MakeMap("site", LayerOfCups("cups", 12));
  }

  static v1::ReplicateRequest Request() {
    v1::ReplicateRequest request;
    request.mutable_scope()->set_map("site");
    return request;
  }

  // The messages up to the first without `more`.
  std::vector<v1::ReplicateResponse> First(const v1::ReplicateRequest& request,
                                           grpc::Status* status) {
    grpc::ClientContext context;
    const auto reader = server_.watch->Replicate(&context, request);
    std::vector<v1::ReplicateResponse> messages;
    for (v1::ReplicateResponse message; reader->Read(&message);) {
      messages.push_back(message);
      if (!message.more()) context.TryCancel();
    }
    *status = reader->Finish();
    return messages;
  }
  std::vector<v1::ReplicateResponse> First(const v1::ReplicateRequest& request) {
    grpc::Status ignored;
    return First(request, &ignored);
  }

  MapSession& session() { return **server_.site().Find("site"); }
  void Touch() {
    const auto receipt = session().SubmitAndWait({{{hypermap::DeleteObject{"cups", 1}}}, "", ""});
    ASSERT_TRUE(receipt.ok()) << receipt.status();
  }

  TestServer server_;
};

TEST_F(ReplicateTest, ASnapshotHasTheMapTheTimeAndTheLayers) {
  const auto messages = First(Request());
  ASSERT_GE(messages.size(), 3u);
  const v1::ReplicateResponse& first = messages.front();
  EXPECT_TRUE(first.snapshot());
  EXPECT_EQ(first.map().name(), "site");
  EXPECT_EQ(first.map().revision(), 1);
  EXPECT_EQ(wire::DecodeTime(first.map().create_time()), session().header().created_at);
  EXPECT_EQ(first.changes(0).kind(), v1::CHANGE_KIND_LAYER_CREATED);
  EXPECT_EQ(first.changes(0).layer_now().version(), 1);
  EXPECT_TRUE(first.has_time());
  EXPECT_FALSE(messages.back().has_map());
}

TEST_F(ReplicateTest, GoesOnAtOnceFromARevisionThatIsKnownByItsTime) {
  const v1::ReplicateResponse snapshot = First(Request()).front();
  Touch();
  v1::ReplicateRequest request = Request();
  request.set_start_revision(1);
  *request.mutable_start_time() = snapshot.time();
  grpc::Status status;
  const auto messages = First(request, &status);
  ASSERT_FALSE(messages.empty()) << status.error_message();
  EXPECT_EQ(messages.front().revision(), 1);
  EXPECT_EQ(messages.front().map().revision(), 2);
  EXPECT_EQ(messages.front().time().seconds(), snapshot.time().seconds());

  request.set_start_revision(0);
  wire::EncodeTime(session().header().created_at, request.mutable_start_time());
  EXPECT_FALSE(First(request).empty());
}

TEST_F(ReplicateTest, ARevisionThatWasMadeAtAnotherTimeIsAborted) {
  v1::ReplicateRequest request = Request();
  request.set_start_revision(1);
  wire::EncodeTime(absl::FromUnixSeconds(1), request.mutable_start_time());
  grpc::Status status;
  EXPECT_TRUE(First(request, &status).empty());
  EXPECT_EQ(status.error_code(), grpc::StatusCode::ABORTED);
  EXPECT_THAT(status.error_message(), HasSubstr("revision 1 was made at"));

  request.clear_start_revision();
  First(request, &status);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(ReplicateTest, ManyCommitsComeInOneMessage) {
  for (int i = 0; i < 300; ++i) {
    hypermap::PutObject put{"cups", {}, ""};
    put.object.label = "cup";
    put.object.shape = Polygon::FromBox({{1.0 * i, 5}, {i + 1.0, 6}});
    const auto receipt = session().SubmitAndWait({{{put}}, "test", ""});
    ASSERT_TRUE(receipt.ok()) << receipt.status();
  }
  v1::ReplicateRequest request = Request();
  request.set_start_revision(1);
  grpc::ClientContext context;
  const auto reader = server_.watch->Replicate(&context, request);
  v1::ReplicateResponse message;
  ASSERT_TRUE(reader->Read(&message));
  EXPECT_EQ(message.map().revision(), 301);
  std::vector<Revision> told;
  int num_messages = 0;
  while (told.size() < 300 && reader->Read(&message)) {
    ++num_messages;
    for (const v1::ReplicateResponse& one : message.coalesced()) {
      EXPECT_TRUE(one.has_time());
      EXPECT_EQ(one.author(), "test");
      if (one.changes_size() > 0) told.push_back(one.revision());
    }
    if (message.changes_size() > 0) told.push_back(message.revision());
  }
  context.TryCancel();
  reader->Finish();
  ASSERT_EQ(told.size(), 300u);
  for (size_t i = 0; i < told.size(); ++i) EXPECT_EQ(told[i], static_cast<Revision>(i + 2));
  EXPECT_LT(num_messages, 10);
}

TEST_F(ReplicateTest, CountsTowardsTheLimitOfWatches) {
  TestServer server({.max_watchers = 1});
  server.MakeMap("site", LayerOfCups("cups", 1));
  v1::WatchRequest watch_request;
  watch_request.mutable_scope()->set_map("site");
  grpc::ClientContext watch_context, context;
  const auto watch = server.watch->Watch(&watch_context, watch_request);
  v1::WatchResponse watched;
  ASSERT_TRUE(watch->Read(&watched));
  const auto reader = server.watch->Replicate(&context, Request());
  v1::ReplicateResponse message;
  EXPECT_FALSE(reader->Read(&message));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  watch_context.TryCancel();
  watch->Finish();
}

}  // namespace
}  // namespace hypermap::server
