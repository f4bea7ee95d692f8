#include "server/services/edit_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <string>
#include <vector>

#include "server/rpc/call_ticket.h"
#include "server/services/testing/test_server.h"
#include "tests/support/eventually.h"
#include "wire/edit.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class EditServiceTest : public ::testing::Test {
 protected:
  EditServiceTest() { server_.MakeMap("site", LayerOfCups("cups", 0)); }

  static v1::ApplyEditsRequest PutCup(const std::string& request_id) {
    v1::ApplyEditsRequest request;
    request.set_map("site");
    request.set_request_id(request_id);
    wire::EncodeEdit(LayerOfCups("cups", 1).edits[1], request.add_edits());
    return request;
  }

  grpc::Status Apply(const v1::ApplyEditsRequest& request, v1::ApplyEditsResponse* response) {
    grpc::ClientContext context;
    return server_.edit->ApplyEdits(&context, request, response);
  }

  Revision revision() { return (*server_.site().Find("site"))->snapshot()->revision; }

  TestServer server_;
};

TEST_F(EditServiceTest, AnswersTheRevisionAndTheIds) {
  v1::ApplyEditsResponse response;
  const grpc::Status status = Apply(PutCup("r1"), &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.map(), "site");
  EXPECT_EQ(response.revision(), 2);
  EXPECT_THAT(response.object_ids(), ElementsAre(1));
}

TEST_F(EditServiceTest, SameRequestAgainGetsTheSameAnswerAndChangesNothing) {
  v1::ApplyEditsResponse first, again;
  ASSERT_TRUE(Apply(PutCup("r1"), &first).ok());
  ASSERT_TRUE(Apply(PutCup("r1"), &again).ok());
  EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString());
  EXPECT_EQ(revision(), 2);
}

TEST_F(EditServiceTest, A3AuthorThatCantBeLoggedIsRefused) {
  for (const std::string& author : {std::string(200, 'a'), std::string("expiry")}) {
    grpc::ClientContext context;
    context.AddMetadata("x-hypermap-author", author);
    v1::ApplyEditsResponse response;
    const grpc::Status status = server_.edit->ApplyEdits(&context, PutCup(""), &response);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << author;
    EXPECT_THAT(status.error_message(), HasSubstr("x-hypermap-author"));
  }
  EXPECT_EQ(revision(), 1);
}

TEST_F(EditServiceTest, OneBadEditChangesNothingAndIsNamed) {
  v1::ApplyEditsRequest request = PutCup("");
  *request.add_edits() = request.edits(0);
  request.mutable_edits(1)->mutable_put_object()->set_layer("nowhere");
  v1::ApplyEditsResponse response;
  const grpc::Status status = Apply(request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("edits[1]"));
  EXPECT_THAT(status.error_message(), HasSubstr("nowhere"));
  EXPECT_EQ(revision(), 1);
}

TEST_F(EditServiceTest, BadRequestsNameTheField) {
  v1::ApplyEditsResponse response;
  v1::ApplyEditsRequest empty = PutCup("");
  empty.clear_edits();
  EXPECT_EQ(Apply(empty, &response).error_message(), "edits is empty");
  const grpc::Status long_id = Apply(PutCup(std::string(129, 'x')), &response);
  EXPECT_EQ(long_id.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(long_id.error_message(), HasSubstr("request_id"));
  EXPECT_EQ(revision(), 1);
}

TEST_F(EditServiceTest, EditThatWantsAnotherVersionOfALayerIsAborted) {
  v1::ApplyEditsRequest request = PutCup("");
  v1::LayerVersion* const wanted = request.add_if_layers();
  wanted->set_layer("cups");
  wanted->set_version(1);
  v1::ApplyEditsResponse response;
  ASSERT_TRUE(Apply(request, &response).ok());
  // The layer has version 2 now.
  const grpc::Status stale = Apply(request, &response);
  EXPECT_EQ(stale.error_code(), grpc::StatusCode::ABORTED);
  EXPECT_THAT(stale.error_message(), HasSubstr("version 2"));
  EXPECT_EQ(revision(), 2);
  wanted->set_version(2);
  EXPECT_TRUE(Apply(request, &response).ok());
}

TEST_F(EditServiceTest, FailedDiskIsToldAndNothingIsVisible) {
  server_.disk().FailWrites(absl::UnavailableError("disk is gone"));
  v1::ApplyEditsResponse response;
  const grpc::Status status = Apply(PutCup("r1"), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(status.error_message(), "disk is gone");
  EXPECT_EQ(revision(), 1);
}

TEST_F(EditServiceTest, TooLargeMessageIsRefused) {
  v1::ApplyEditsRequest request = PutCup("");
  request.mutable_edits(0)->mutable_put_object()->mutable_object()->set_label(
      std::string(2 << 20, 'x'));
  v1::ApplyEditsResponse response;
  EXPECT_EQ(Apply(request, &response).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST(EditServiceMemoryTest, B7_LargeRequestsHoldABoundedMemoryTogether) {
  Limits limits;
  limits.max_request_bytes = 1 << 20;
  TestServer server(limits);
  server.MakeMap("site", LayerOfCups("cups", 0));
  server.MakeMap("other", LayerOfCups("cups", 0));
  const auto request = [](const std::string& map, int num_cups) {
    v1::ApplyEditsRequest made;
    made.set_map(map);
    const EditBatch cups = LayerOfCups("cups", num_cups);
    for (size_t i = 1; i < cups.edits.size(); ++i)
      wire::EncodeEdit(cups.edits[i], made.add_edits());
    return made;
  };
  const auto apply = [&](const v1::ApplyEditsRequest& edits) {
    grpc::ClientContext context;
    v1::ApplyEditsResponse response;
    return server.edit->ApplyEdits(&context, edits, &response);
  };
  const v1::ApplyEditsRequest large = request("site", 2000);
  ASSERT_GT(large.ByteSizeLong(), size_t{100'000});
  server.disk().Hold();
  // Alone it is accepted, although it is larger than the client's half.
  auto first = std::async(std::launch::async, [&] { return apply(large); });
  server.disk().AwaitHeldWrite();
  EXPECT_GE(server.budgets().request_bytes.used(),
            static_cast<int64_t>(large.ByteSizeLong() + 2 * large.SpaceUsedLong()));
  // Another map makes no difference.
  const grpc::Status refused = apply(request("other", 2000));
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("--max_request_bytes, 1048576 bytes"));
  // Small requests go on.
  auto small = std::async(std::launch::async, [&] { return apply(request("other", 1)); });
  server.disk().Release();
  EXPECT_TRUE(first.get().ok());
  const grpc::Status went_on = small.get();
  EXPECT_TRUE(went_on.ok()) << went_on.error_message();
  // The memory is given back before the answer is sent.
  EXPECT_EQ(server.budgets().request_bytes.used(), 0);
  const grpc::Status accepted = apply(request("other", 2000));
  EXPECT_TRUE(accepted.ok()) << accepted.error_message();
}

TEST(EditServiceQueueTest, OneClientAddressFillsHalfOfTheQueueOfAMap) {
  SessionOptions options;
  options.limits.max_queue = 4;
  TestServer server({}, 1 << 20, options);
  server.MakeMap("site", LayerOfCups("cups", 0));
  MapSession& session = **server.site().Find("site");
  const EditBatch cup{{LayerOfCups("cups", 1).edits[1]}};
  const auto apply = [&] {
    v1::ApplyEditsRequest request;
    request.set_map("site");
    wire::EncodeEdit(cup.edits[0], request.add_edits());
    grpc::ClientContext context;
    v1::ApplyEditsResponse response;
    return server.edit->ApplyEdits(&context, request, &response);
  };
  server.disk().Hold();
  std::vector<std::future<grpc::Status>> answers;
  answers.push_back(std::async(std::launch::async, apply));
  server.disk().AwaitHeldWrite();
  // Two of these wait in the queue, and the third is refused.
  for (int i = 0; i < 3; ++i) answers.push_back(std::async(std::launch::async, apply));
  ASSERT_TRUE(
      testing::Eventually([&] { return server.budgets().refusals.NumOf("--max_queue") == 1; }));
  std::promise<absl::Status> own;
  session.Submit({cup, "test", ""}, [&own](const absl::StatusOr<storage::Receipt>& receipt) {
    own.set_value(receipt.status());
  });
  server.disk().Release();
  EXPECT_TRUE(own.get_future().get().ok());
  int refused = 0;
  for (std::future<grpc::Status>& answer : answers) {
    const grpc::Status status = answer.get();
    if (status.ok()) continue;
    ++refused;
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), HasSubstr("half of --max_queue, 4"));
  }
  EXPECT_EQ(refused, 1);
}

TEST_F(EditServiceTest, ShutdownAnswersTheEditInFlight) {
  server_.disk().Hold();
  v1::ApplyEditsResponse response;
  auto answer = std::async(std::launch::async, [&] { return Apply(PutCup("r1"), &response); });
  server_.disk().AwaitHeldWrite();
  auto shutdown = std::async(std::launch::async, [&] { server_.Shutdown(absl::Minutes(1)); });
  server_.disk().Release();
  EXPECT_TRUE(answer.get().ok());
  EXPECT_EQ(response.revision(), 2);
  shutdown.get();
}

}  // namespace
}  // namespace hypermap::server
