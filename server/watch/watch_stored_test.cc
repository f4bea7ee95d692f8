// Watches with `as_stored`, as replicas open them.
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
class StoredWatchTest : public ::testing::Test {
 protected:
  StoredWatchTest() : server_({.chunk_items = 5, .watch_progress = absl::Milliseconds(20)}) {
    server_.MakeMap("site", LayerOfCups("cups", 12));
  }

  static v1::WatchRequest Request() {
    v1::WatchRequest request;
    request.mutable_scope()->set_map("site");
    request.set_as_stored(true);
    request.set_coalesce(true);
    return request;
  }

  // The messages up to the first without `more`.
  std::vector<v1::WatchResponse> First(const v1::WatchRequest& request, grpc::Status* status) {
    grpc::ClientContext context;
    const auto reader = server_.watch->Watch(&context, request);
    std::vector<v1::WatchResponse> messages;
    for (v1::WatchResponse message; reader->Read(&message);) {
      messages.push_back(message);
      if (!message.more()) context.TryCancel();
    }
    *status = reader->Finish();
    return messages;
  }
  std::vector<v1::WatchResponse> First(const v1::WatchRequest& request) {
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

TEST_F(StoredWatchTest, ASnapshotHasTheMapTheTimeAndTheLayers) {
  const auto messages = First(Request());
  ASSERT_GE(messages.size(), 3u);
  const v1::WatchResponse& first = messages.front();
  EXPECT_TRUE(first.snapshot());
  EXPECT_EQ(first.map().name(), "site");
  EXPECT_EQ(first.map().revision(), 1);
  EXPECT_EQ(wire::DecodeTime(first.map().create_time()), session().header().created_at);
  EXPECT_EQ(first.changes(0).kind(), v1::CHANGE_KIND_LAYER_CREATED);
  EXPECT_EQ(first.changes(0).layer_now().version(), 1);
  EXPECT_TRUE(first.has_time());
  EXPECT_FALSE(messages.back().has_map());
}

TEST_F(StoredWatchTest, GoesOnAtOnceFromARevisionThatIsKnownByItsTime) {
  const v1::WatchResponse snapshot = First(Request()).front();
  Touch();
  v1::WatchRequest request = Request();
  request.set_start_revision(1);
  *request.mutable_start_time() = snapshot.time();
  const auto messages = First(request);
  ASSERT_FALSE(messages.empty());
  EXPECT_EQ(messages.front().revision(), 1);
  EXPECT_EQ(messages.front().map().revision(), 2);
  EXPECT_EQ(messages.front().time().seconds(), snapshot.time().seconds());

  request.set_start_revision(0);
  wire::EncodeTime(session().header().created_at, request.mutable_start_time());
  EXPECT_FALSE(First(request).empty());
}

TEST_F(StoredWatchTest, ARevisionThatWasMadeAtAnotherTimeIsAborted) {
  v1::WatchRequest request = Request();
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

}  // namespace
}  // namespace hypermap::server
