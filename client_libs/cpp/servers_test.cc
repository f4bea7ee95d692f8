// Tests of clients that know several servers: which one they ask, and what they tell it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_libs/cpp/client.h"
#include "client_libs/testing/scripted_server.h"

namespace hypermap::client {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

Script UnavailableFor(int calls) {
  Script script;
  script.outage = calls;
  return script;
}

std::string AddressesOf(const ScriptedServer& first, const ScriptedServer& second) {
  return absl::StrCat(first.address(), ", ", second.address());
}

// The address of a server that is gone.
std::string DeadAddress() { return ScriptedServer({}).address(); }

TEST(ServersTest, TheFirstIsAskedAsLongAsItAnswers) {
  ScriptedServer first({});
  ScriptedServer second({});
  Client client(AddressesOf(first, second));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(client.ListMaps().ok());
  EXPECT_THAT(first.Requests(), SizeIs(3));
  EXPECT_THAT(second.Requests(), IsEmpty());
}

TEST(ServersTest, TheNextIsAskedWhenOneIsUnavailableAndStays) {
  ScriptedServer first(UnavailableFor(1));
  ScriptedServer second({});
  Client client(AddressesOf(first, second));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(client.ListMaps().ok());
  EXPECT_THAT(first.Requests(), SizeIs(1));
  EXPECT_THAT(second.Requests(), SizeIs(3));
}

TEST(ServersTest, TheyAreAskedInACircle) {
  ScriptedServer first(UnavailableFor(2));
  ScriptedServer second(UnavailableFor(99));
  EXPECT_TRUE(Client(AddressesOf(first, second)).ListMaps().ok());
  EXPECT_THAT(first.Requests(), SizeIs(3));
  EXPECT_THAT(second.Requests(), SizeIs(2));
}

TEST(ServersTest, OneThatCannotBeReachedIsPassedOverAlsoWithoutRetries) {
  ScriptedServer server({});
  Client client(absl::StrCat(DeadAddress(), ",", server.address()),
                {.retry_for = absl::ZeroDuration()});
  EXPECT_TRUE(client.ListMaps().ok());
}

TEST(ServersTest, WithoutRetriesEachIsTriedOnce) {
  ScriptedServer first(UnavailableFor(99));
  ScriptedServer second(UnavailableFor(99));
  Client client(AddressesOf(first, second), {.retry_for = absl::ZeroDuration()});
  EXPECT_EQ(client.ListMaps().status(), absl::UnavailableError("outage"));
  EXPECT_THAT(first.Requests(), SizeIs(1));
  EXPECT_THAT(second.Requests(), SizeIs(1));
}

TEST(ServersTest, OtherErrorsAreTheAnswer) {
  Script script;
  script.status = grpc::Status(grpc::StatusCode::NOT_FOUND, "no map");
  ScriptedServer first(script);
  ScriptedServer second({});
  EXPECT_EQ(Client(AddressesOf(first, second)).ListMaps().status(), absl::NotFoundError("no map"));
  EXPECT_THAT(second.Requests(), IsEmpty());
}

TEST(ServersTest, AMutationHasTheSameIdAtTheNext) {
  ScriptedServer first(UnavailableFor(1));
  ScriptedServer second({});
  Client client(AddressesOf(first, second));
  ASSERT_TRUE(client.ApplyEdits("office", {{DeleteObject{"objects", 3}}}).ok());
  EXPECT_THAT(first.RequestIds(), SizeIs(1));
  EXPECT_EQ(first.RequestIds(), second.RequestIds());
}

TEST(ServersTest, AnAnswerThatBreaksOffSendsTheNextCallElsewhere) {
  Script script;
  script.backup_pieces = {"one"};
  script.status = grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone");
  ScriptedServer first(script);
  ScriptedServer second({});
  Client client(AddressesOf(first, second));
  ByteReader reader = client.BackupMap("office");
  while (reader.Next()) {
  }
  EXPECT_EQ(reader.status(), absl::UnavailableError("gone"));
  EXPECT_TRUE(client.ListMaps().ok());
  EXPECT_THAT(second.Requests(), ElementsAre("ListMaps"));
}

v1::WatchResponse Told(int64_t revision, bool snapshot) {
  v1::WatchResponse message;
  message.set_revision(revision);
  message.set_incarnation(7);
  message.set_snapshot(snapshot);
  return message;
}

TEST(ServersTest, AWatchGoesOnAtTheNextAlsoIfThatIsAMomentBehind) {
  Script begins;
  begins.watches = {{.responses = {Told(4, true)}}};
  ScriptedServer first(begins);
  const grpc::Status behind(grpc::StatusCode::UNAVAILABLE, "start_revision 4 is still to come");
  Script goes_on;
  goes_on.watches = {{.status = behind}, {.responses = {Told(5, false)}, .stays = true}};
  ScriptedServer second(goes_on);
  // The first server has no answer any more, and ends further watches at once.
  Client client(AddressesOf(first, second));
  Watcher watcher = client.Watch("office");
  ASSERT_EQ(watcher.Next()->revision, 4);
  const std::optional<WatchEvent> next = watcher.Next();
  ASSERT_TRUE(next.has_value()) << watcher.status();
  EXPECT_EQ(next->revision, 5);
  EXPECT_THAT(second.Requests(),
              Each(AllOf(HasSubstr("start_revision: 4"), HasSubstr("incarnation: 7"))));
}

TEST(ServersTest, AQueryNamesTheNewestRevisionOfItsMapThatWasSeen) {
  Script script;
  script.edits.set_revision(8);
  script.edits.set_incarnation(7);
  script.point.set_revision(6);
  script.point.set_incarnation(7);
  ScriptedServer server(script);
  Client client(server.address());
  ASSERT_TRUE(client.QueryPoint("office", {0, 0}).ok());
  ASSERT_TRUE(client.ApplyEdits("office", {{DeleteObject{"objects", 3}}}).ok());
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(client.QueryPoint("office", {0, 0}).ok());
  ASSERT_TRUE(client.QueryPoint("attic", {0, 0}).ok());
  const auto sees = [](int revision) {
    return HasSubstr(absl::StrCat("seen_revision: ", revision, " seen_incarnation: 7"));
  };
  const auto sees_nothing = Not(HasSubstr("seen_revision"));
  EXPECT_THAT(server.Requests(),
              ElementsAre(sees_nothing, HasSubstr("ApplyEdits"), sees(8), sees(8), sees_nothing));
}

TEST(ServersTest, AQueryNamesTheRevisionThatAWatchHasTold) {
  Script script;
  script.watches = {{.responses = {Told(4, true)}, .stays = true}};
  ScriptedServer server(script);
  Client client(server.address());
  Watcher watcher = client.Watch("office");
  ASSERT_EQ(watcher.Next()->revision, 4);
  ASSERT_TRUE(client.QueryPoint("office", {0, 0}).ok());
  EXPECT_THAT(server.Requests().back(), HasSubstr("seen_revision: 4 seen_incarnation: 7"));
}

TEST(ServersTest, AnOlderAnswerThanWasSeenIsAskedForAgain) {
  Script script;
  script.edits.set_revision(8);
  script.edits.set_incarnation(7);
  script.revisions.set_newest_revision(7);
  script.revisions.set_incarnation(7);
  ScriptedServer behind(script);
  script.revisions.set_newest_revision(8);
  ScriptedServer other(script);
  Client client(AddressesOf(behind, other));
  EXPECT_EQ(client.ListRevisions("office")->newest, 7);
  ASSERT_TRUE(client.ApplyEdits("office", {{DeleteObject{"objects", 3}}}).ok());
  EXPECT_EQ(client.ListRevisions("office")->newest, 8);
  EXPECT_THAT(other.Requests(), SizeIs(1));
  // The answer to a mutation may be old: that of a repetition is.
  EXPECT_TRUE(client.ApplyEdits("office", {{DeleteObject{"objects", 3}}}).ok());
}

TEST(ServersTest, NoTokenLeavesIfItMayNotBeSentToOneOfThem) {
  ScriptedServer server({});
  Client client(absl::StrCat(server.address(), ",robots.example:50051"),
                {.token = [] { return std::string("secret"); }});
  const absl::Status status = client.ListMaps().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnauthenticated);
  EXPECT_THAT(status.message(), HasSubstr("robots.example"));
  EXPECT_THAT(server.Requests(), IsEmpty());
}

}  // namespace
}  // namespace hypermap::client
