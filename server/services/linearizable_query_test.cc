// Linearizable questions to a server that shares its maps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "server/services/testing/test_server.h"
#include "wire/points.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

// The map "site" at revision 1, in a store that tells of newer revisions when a test says so.
class LinearizableQueryTest : public ::testing::Test {
 protected:
  LinearizableQueryTest() : server_({}, 1 << 20, {}, {}, "a") {
    server_.MakeMap("site", LayerOfCups("cups", 1));
  }

  MapSession& session() { return **server_.site().Find("site"); }
  void Edit() {
    const auto receipt =
        session().SubmitAndWait({{{hypermap::SetTransform{{"map", "dock", {}}}}}, "test", ""});
    EXPECT_TRUE(receipt.ok()) << receipt.status();
  }
  void TellNewest(Revision revision) {
    server_.disk().TellNewest("site", {session().incarnation(), revision});
  }

  template <typename Request>
  static Request Ask() {
    Request request;
    request.mutable_scope()->set_map("site");
    request.mutable_as_of()->set_consistency(v1::CONSISTENCY_LINEARIZABLE);
    return request;
  }
  struct Answer {
    grpc::Status status;
    Revision revision = 0;
  };
  static void SetDeadline(grpc::ClientContext& context) {
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
  }
  Answer AskPoint() {
    auto request = Ask<v1::QueryPointRequest>();
    request.mutable_point();
    grpc::ClientContext context;
    SetDeadline(context);
    v1::QueryPointResponse response;
    Answer answer{server_.query->QueryPoint(&context, request, &response)};
    answer.revision = response.revision();
    return answer;
  }
  Answer AskValue() {
    auto request = Ask<v1::QueryValueRequest>();
    request.set_value("cup");
    grpc::ClientContext context;
    SetDeadline(context);
    auto reader = server_.query->QueryValue(&context, request);
    Answer answer;
    v1::QueryValueResponse response;
    while (reader->Read(&response)) answer.revision = response.revision();
    answer.status = reader->Finish();
    return answer;
  }
  // Asks one batch after the opening.
  Answer AskPoints() {
    grpc::ClientContext context;
    SetDeadline(context);
    auto stream = server_.query->QueryPoints(&context);
    v1::QueryPointsRequest opening;
    *opening.mutable_opening()->mutable_scope() = Ask<v1::QueryPointRequest>().scope();
    *opening.mutable_opening()->mutable_as_of() = Ask<v1::QueryPointRequest>().as_of();
    v1::QueryPointsRequest batch;
    wire::EncodePoints({{0.5, 0.5}}, &batch);
    stream->Write(opening);
    stream->Write(batch);
    stream->WritesDone();
    Answer answer;
    v1::QueryPointsResponse response;
    while (stream->Read(&response)) answer.revision = response.revision();
    answer.status = stream->Finish();
    return answer;
  }

  static constexpr Answer (LinearizableQueryTest::*kQuestions[])() = {
      &LinearizableQueryTest::AskPoint, &LinearizableQueryTest::AskValue,
      &LinearizableQueryTest::AskPoints};

  TestServer server_;
};

TEST_F(LinearizableQueryTest, IsAnsweredWhenTheNewestRevisionIsHere) {
  for (const auto ask : kQuestions) {
    const Answer answer = (this->*ask)();
    EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
    EXPECT_EQ(answer.revision, 1);
  }
}

TEST_F(LinearizableQueryTest, WaitsForTheRevisionThatTheStoreTells) {
  for (const auto ask : kQuestions) {
    const Revision newer = session().snapshot()->revision + 1;
    TellNewest(newer);
    server_.disk().HoldNewest();
    std::thread asking([&] {
      const Answer answer = (this->*ask)();
      EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
      EXPECT_EQ(answer.revision, newer);
    });
    server_.disk().AwaitHeldNewest();
    server_.disk().ReleaseNewest();
    Edit();
    asking.join();
  }
}

TEST_F(LinearizableQueryTest, IsUnavailableIfTheStoreCanNotBeAsked) {
  server_.disk().FailNewest(absl::UnavailableError("no database"));
  for (const auto ask : kQuestions) {
    const Answer answer = (this->*ask)();
    EXPECT_EQ(answer.status.error_code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_THAT(answer.status.error_message(), HasSubstr("no database"));
  }
  // Other questions do not ask the store.
  auto local = Ask<v1::QueryPointRequest>();
  local.mutable_point();
  local.clear_as_of();
  grpc::ClientContext context;
  v1::QueryPointResponse response;
  EXPECT_TRUE(server_.query->QueryPoint(&context, local, &response).ok());
}

TEST_F(LinearizableQueryTest, IsNotAnsweredFromAMapThatWasReplacedElsewhere) {
  server_.disk().TellNewest("site", {session().incarnation() + 1, 0});
  for (const auto ask : kQuestions) {
    const Answer answer = (this->*ask)();
    EXPECT_EQ(answer.status.error_code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_THAT(answer.status.error_message(), HasSubstr("as it is now"));
  }
}

TEST_F(LinearizableQueryTest, EndsWithTheSessionThatDoesNotGetTheRevision) {
  for (const auto ask : kQuestions) {
    TellNewest(99);
    server_.disk().HoldNewest();
    std::thread asking([&] {
      const grpc::Status status = (this->*ask)().status;
      EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
    });
    server_.disk().AwaitHeldNewest();
    server_.disk().ReleaseNewest();
    ASSERT_TRUE(server_.site().Delete("site", "").ok());
    asking.join();
    server_.MakeMap("site", LayerOfCups("cups", 1));
  }
}

TEST_F(LinearizableQueryTest, EndsAtItsDeadline) {
  TellNewest(99);
  auto request = Ask<v1::QueryPointRequest>();
  request.mutable_point();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(50));
  v1::QueryPointResponse response;
  EXPECT_EQ(server_.query->QueryPoint(&context, request, &response).error_code(),
            grpc::StatusCode::DEADLINE_EXCEEDED);
}

TEST_F(LinearizableQueryTest, AStoreOfOneServerIsNotAsked) {
  TestServer alone;
  alone.MakeMap("site", LayerOfCups("cups", 1));
  alone.disk().FailNewest(absl::UnavailableError("no database"));
  auto request = Ask<v1::QueryPointRequest>();
  request.mutable_point();
  grpc::ClientContext context;
  v1::QueryPointResponse response;
  EXPECT_TRUE(alone.query->QueryPoint(&context, request, &response).ok());
  EXPECT_EQ(response.revision(), 1);
}

}  // namespace
}  // namespace hypermap::server
