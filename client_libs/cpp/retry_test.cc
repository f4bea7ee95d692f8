// Tests of calls that reach the server only after retries.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "client_libs/cpp/backoff.h"
#include "client_libs/cpp/client.h"
#include "client_libs/testing/scripted_server.h"

namespace hypermap::client {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::SizeIs;

Script Outage(int calls) {
  Script script;
  script.outage = calls;
  return script;
}

TEST(BackoffTest, WaitsGrowToALimitAndBeginAnew) {
  Backoff backoff;
  absl::Duration longest = absl::Milliseconds(50);
  for (int i = 0; i < 12; ++i) {
    const absl::Duration wait = backoff.Next();
    EXPECT_GE(wait, longest / 2);
    EXPECT_LE(wait, longest);
    longest = std::min(2 * longest, absl::Seconds(2));
  }
  backoff.Reset();
  EXPECT_LE(backoff.Next(), absl::Milliseconds(50));
}

TEST(RetryTest, AQueryIsAskedAgain) {
  ScriptedServer server(Outage(2));
  EXPECT_TRUE(Client(server.address()).ListMaps().ok());
  EXPECT_THAT(server.Requests(), ElementsAre("ListMaps", "ListMaps", "ListMaps"));
}

TEST(RetryTest, AMutationIsSentAgainWithItsId) {
  ScriptedServer server(Outage(2));
  ASSERT_TRUE(Client(server.address()).ApplyEdits("office", {{DeleteObject{"objects", 3}}}).ok());
  const std::vector<std::string> ids = server.RequestIds();
  EXPECT_THAT(ids, SizeIs(3));
  EXPECT_THAT(ids, Each(ids.front()));
}

TEST(RetryTest, FilesAreSentAgainWhole) {
  ScriptedServer server(Outage(1));
  ASSERT_TRUE(
      Client(server.address()).ImportMap("office", FileFormat::kHmap, {{"a.hmap", "zip"}}).ok());
  EXPECT_THAT(server.RequestIds(), SizeIs(2));
  EXPECT_EQ(server.ImportedData(), "zip");
}

TEST(RetryTest, AnAnswerInPartsThatHasNotBegunIsAskedForAgain) {
  Script script = Outage(1);
  script.backup_pieces = {"one", "two"};
  ScriptedServer server(script);
  ByteReader reader = Client(server.address()).BackupMap("office");
  EXPECT_EQ(reader.Next(), "one");
  EXPECT_EQ(reader.Next(), "two");
  EXPECT_EQ(reader.Next(), std::nullopt);
  EXPECT_TRUE(reader.status().ok()) << reader.status();
}

TEST(RetryTest, AnAnswerThatHasBegunIsNotAskedForAgain) {
  Script script;
  script.backup_pieces = {"one"};
  script.status = grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone");
  ScriptedServer server(script);
  ByteReader reader = Client(server.address()).BackupMap("office");
  EXPECT_EQ(reader.Next(), "one");
  EXPECT_EQ(reader.Next(), std::nullopt);
  EXPECT_EQ(reader.status(), absl::UnavailableError("gone"));
  EXPECT_THAT(server.Requests(), SizeIs(1));
}

TEST(RetryTest, CanBeSwitchedOff) {
  ScriptedServer server(Outage(1));
  Client client(server.address(), {.retry_for = absl::ZeroDuration()});
  EXPECT_EQ(client.ListMaps().status(), absl::UnavailableError("outage"));
  EXPECT_THAT(server.Requests(), SizeIs(1));
}

TEST(RetryTest, CanBeSwitchedOffForACall) {
  ScriptedServer server(Outage(1));
  Client client(server.address());
  EXPECT_EQ(client.ListMaps({.retry_for = absl::ZeroDuration()}).status(),
            absl::UnavailableError("outage"));
  EXPECT_THAT(server.Requests(), SizeIs(1));
}

TEST(RetryTest, OtherErrorsAreNotTriedAgain) {
  Script script;
  script.status = grpc::Status(grpc::StatusCode::ABORTED, "stale");
  ScriptedServer server(script);
  EXPECT_EQ(Client(server.address()).ListMaps().status(), absl::AbortedError("stale"));
  EXPECT_THAT(server.Requests(), SizeIs(1));
}

TEST(RetryTest, ACallerThatIsNotKnownIsToldAtOnce) {
  Script script;
  script.status = grpc::Status(grpc::StatusCode::UNAUTHENTICATED, "the token has expired");
  ScriptedServer server(script);
  Client client(server.address());
  EXPECT_EQ(client.ListMaps().status(), absl::UnauthenticatedError("the token has expired"));
  EXPECT_THAT(server.Requests(), SizeIs(1));
}

TEST(RetryTest, EndsWithTheCallsDeadline) {
  ScriptedServer server(Outage(1'000'000));
  Client client(server.address(), {.timeout = absl::Milliseconds(200)});
  const absl::StatusCode code = client.ListMaps().status().code();
  EXPECT_TRUE(code == absl::StatusCode::kUnavailable || code == absl::StatusCode::kDeadlineExceeded)
      << absl::StatusCodeToString(code);
}

}  // namespace
}  // namespace hypermap::client
